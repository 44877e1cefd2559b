#include "datasets/sequence_check.h"

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <opencv2/core.hpp>

#include "tests/datasets/synthetic_frames.h"

namespace crumple {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

const SyntheticSequence& clean() {
  static const SyntheticSequence sequence = synthetic_sequence();
  return sequence;
}

const SyntheticSequence& clean_without_inverses() {
  static const SyntheticSequence sequence = synthetic_sequence(false);
  return sequence;
}

std::string name(std::size_t frame) { return fmt::format("f{:02}.png", frame); }

// All findings' sentences, one a line.
std::string sentences(const SyntheticSequence& sequence) {
  std::string all;
  for (const Finding& finding : check_sequence(sequence.frames, sequence.setup)) all += finding.sentence + "\n";
  return all;
}

void exchange(SyntheticSequence& sequence, std::size_t a, std::size_t b) {
  std::swap(sequence.frames[a].image, sequence.frames[b].image);
}

void drop(SyntheticSequence& sequence, std::size_t frame) {
  for (std::size_t i = frame; i + 1 < sequence.frames.size(); ++i)
    sequence.frames[i].image = sequence.frames[i + 1].image;
  sequence.frames.back().image = cv::Mat();
}

TEST(SequenceCheck, CleanFramesPass) {
  EXPECT_EQ(sentences(clean()), "");
  EXPECT_EQ(sentences(clean_without_inverses()), "");
}

TEST(SequenceCheck, NamesEveryPatternSwappedWithItsInverse) {
  for (std::size_t pattern = 0; pattern < 32; pattern += 2) {
    SyntheticSequence sequence = clean();
    exchange(sequence, pattern, pattern + 1);
    const std::string found = sentences(sequence);
    EXPECT_THAT(found, AllOf(HasSubstr(name(pattern)), HasSubstr(name(pattern + 1)), HasSubstr("swapped")));
    EXPECT_EQ(std::count(found.begin(), found.end(), '\n'), 1) << found;
  }
}

TEST(SequenceCheck, NamesAnyTwoFramesSwapped) {
  cv::RNG generator(5);
  for (int trial = 0; trial < 30; ++trial) {
    const auto a = static_cast<std::size_t>(generator(34U));
    const auto b = static_cast<std::size_t>(generator(34U));
    if (a == b) continue;
    SyntheticSequence sequence = clean();
    exchange(sequence, a, b);
    const std::string found = sentences(sequence);
    EXPECT_THAT(found, AllOf(HasSubstr(name(a)), HasSubstr(name(b)), HasSubstr("swapped"))) << a << " and " << b;
    EXPECT_EQ(std::count(found.begin(), found.end(), '\n'), 1) << found;
  }
}

TEST(SequenceCheck, NamesSwapsWithoutInverses) {
  // The coarsest bit of the columns (frame 0) has nothing to be exchanged with but other bits.
  for (const auto& [a, b] : {std::pair{0, 1}, {3, 4}, {6, 7}, {2, 11}, {8, 15}, {16, 17}}) {
    SyntheticSequence sequence = clean_without_inverses();
    exchange(sequence, a, b);
    EXPECT_THAT(sentences(sequence), AllOf(HasSubstr(name(a)), HasSubstr(name(b)), HasSubstr("swapped")));
  }
}

TEST(SequenceCheck, NamesTwoPairsSwapped) {
  SyntheticSequence sequence = clean();
  exchange(sequence, 6, 7);
  exchange(sequence, 28, 29);
  const std::string found = sentences(sequence);
  for (const std::size_t frame : {6, 7, 28, 29}) EXPECT_THAT(found, HasSubstr(name(frame)));
  EXPECT_EQ(std::count(found.begin(), found.end(), '\n'), 2) << found;
}

TEST(SequenceCheck, NamesWhiteAndBlackSwapped) {
  SyntheticSequence sequence = clean();
  exchange(sequence, 32, 33);
  EXPECT_THAT(sentences(sequence), HasSubstr("f32.png (white) and f33.png (black) are swapped"));
}

TEST(SequenceCheck, NamesTheFrameThatWasDropped) {
  for (std::size_t dropped = 0; dropped < 33; ++dropped) {
    SyntheticSequence sequence = clean();
    drop(sequence, dropped);
    EXPECT_THAT(sentences(sequence), AllOf(HasSubstr("a frame was dropped"), HasSubstr(name(dropped)))) << dropped;
  }
}

TEST(SequenceCheck, NamesTheImageTooMany) {
  for (const std::size_t repeated : {3, 14, 21, 30}) {
    SyntheticSequence sequence = clean();
    for (std::size_t i = 33; i > repeated; --i) sequence.frames[i].image = clean().frames[i - 1].image;
    EXPECT_THAT(sentences(sequence), AllOf(HasSubstr("an image too many"), HasSubstr(name(repeated)))) << repeated;
  }
}

TEST(SequenceCheck, NamesOneBadFrame) {
  SyntheticSequence dark = clean();
  dark.frames[13].image = clean().frames[33].image;
  EXPECT_THAT(sentences(dark),
              HasSubstr("f13.png (the inverse of bit 6 of orientation 0) does not show what it should: "
                        "it is dark all over"));
  SyntheticSequence same = clean();
  same.frames[21].image = clean().frames[20].image;
  EXPECT_THAT(sentences(same), HasSubstr("it shows the same as f20.png"));
}

TEST(SequenceCheck, NamesOtherOrders) {
  SyntheticSequence inverses_first = clean();
  for (std::size_t i = 0; i < 32; i += 2) exchange(inverses_first, i, i + 1);
  EXPECT_THAT(sentences(inverses_first), HasSubstr("orientation 0, 1 shows each inverse before its pattern"));

  SyntheticSequence finest_first = clean();
  for (std::size_t bit = 0; bit < 8; ++bit) {
    finest_first.frames[16 + 2 * bit].image = clean().frames[16 + 2 * (7 - bit)].image;
    finest_first.frames[17 + 2 * bit].image = clean().frames[17 + 2 * (7 - bit)].image;
  }
  EXPECT_THAT(sentences(finest_first), HasSubstr("orientation 1 shows the finest bit first"));
}

TEST(SequenceCheck, NoticesExchangedOrientations) {
  SyntheticSequence sequence = clean();
  for (std::size_t i = 0; i < 16; ++i) exchange(sequence, i, i + 16);
  EXPECT_THAT(sentences(sequence), HasSubstr("orientations are listed in the order they were shown"));
}

TEST(SequenceCheck, NoticesFlippedImages) {
  SyntheticSequence sequence = clean();
  for (std::size_t i = 0; i < sequence.frames.size(); ++i) {
    cv::Mat flipped;
    cv::flip(clean().frames[i].image, flipped, 1);
    sequence.frames[i].image = flipped;
  }
  EXPECT_THAT(sentences(sequence), HasSubstr("the projection was flipped"));
}

TEST(SequenceCheck, NoticesAProjectorThatLightsNothing) {
  SyntheticSequence sequence = clean();
  for (ShownFrame& frame : sequence.frames) frame.image = clean().frames[33].image;
  EXPECT_THAT(sentences(sequence), HasSubstr("the projector lights none"));

  SyntheticSequence references = sequence;
  references.frames.erase(references.frames.begin(), references.frames.begin() + 32);
  EXPECT_THAT(sentences(references), HasSubstr("the projector lights none"));
}

TEST(SequenceCheck, DeepImagesGiveTheSameVerdict) {
  SyntheticSequence sequence = clean();
  for (ShownFrame& frame : sequence.frames) frame.image.convertTo(frame.image, CV_16U, 16);
  sequence.setup.full_scale = 4095;
  EXPECT_EQ(sentences(sequence), "");
  exchange(sequence, 10, 11);
  EXPECT_THAT(sentences(sequence), AllOf(HasSubstr("f10.png"), HasSubstr("f11.png"), HasSubstr("swapped")));
}

TEST(SequenceCheck, LargeImagesAreSampledInBands) {
  SyntheticSequence sequence = clean();
  for (ShownFrame& frame : sequence.frames) {
    cv::Mat larger;
    cv::resize(frame.image, larger, {}, 4, 4, cv::INTER_CUBIC);
    frame.image = larger;
  }
  EXPECT_EQ(sentences(sequence), "");
  exchange(sequence, 4, 19);
  EXPECT_THAT(sentences(sequence), AllOf(HasSubstr("f04.png"), HasSubstr("f19.png"), HasSubstr("swapped")));
}

TEST(SequenceCheck, MissingFramesAreLeftOut) {
  SyntheticSequence sequence = clean();
  sequence.frames[7].image = cv::Mat();
  sequence.frames[32].image = cv::Mat();
  EXPECT_EQ(sentences(sequence), "");
  for (ShownFrame& frame : sequence.frames) frame.image = cv::Mat();
  EXPECT_EQ(sentences(sequence), "");
}

}  // namespace
}  // namespace crumple
