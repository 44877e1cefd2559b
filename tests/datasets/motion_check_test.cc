#include "datasets/motion_check.h"

#include <utility>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/datasets/synthetic_frames.h"

namespace crumple {
namespace {

using testing::HasSubstr;

void shift(ShownFrame& frame, double x_px, double y_px) {
  const cv::Matx23d move(1, 0, x_px, 0, 1, y_px);
  cv::warpAffine(frame.image, frame.image, move, frame.image.size(), cv::INTER_CUBIC, cv::BORDER_REPLICATE);
}

std::vector<Finding> findings(const SyntheticSequence& sequence) {
  return check_motion(sequence.frames, 255, "station 1, camera cam");
}

TEST(MotionCheck, AStillSceneIsStill) { EXPECT_TRUE(findings(synthetic_sequence()).empty()); }

TEST(MotionCheck, NamesTheFramesOfAStep) {
  // What is seen of a step is its part across the edges, here some 0.6 of it.
  for (const double step_px : {0.3, 1.5}) {
    SyntheticSequence sequence = synthetic_sequence();
    for (std::size_t i = 12; i < sequence.frames.size(); ++i) shift(sequence.frames[i], 0.8 * step_px, -0.6 * step_px);
    const auto found = findings(sequence);
    ASSERT_EQ(found.size(), 1U) << step_px;
    EXPECT_EQ(found[0].severity, step_px < 0.5 ? Severity::warning : Severity::error) << found[0].sentence;
    EXPECT_THAT(found[0].sentence, HasSubstr("moved by about"));
    EXPECT_THAT(found[0].sentence, HasSubstr("between f10.png and f13.png"));
  }
}

// The pair's images are of either place. Where its stripes are wide, its sum is seen shifted against both neighbours;
// where they are fine, against neither.
TEST(MotionCheck, NamesThePairThatAPushWasIn) {
  for (const auto& [pushed, step_px] : {std::pair{5U, 1.5}, {5U, 0.6}, {13U, 1.5}, {21U, 1.5}}) {
    SyntheticSequence sequence = synthetic_sequence();
    for (std::size_t i = pushed; i < sequence.frames.size(); ++i) {
      shift(sequence.frames[i], 0.8 * step_px, -0.6 * step_px);
    }
    const auto found = findings(sequence);
    ASSERT_EQ(found.size(), 1U) << pushed << ", " << step_px;
    EXPECT_EQ(found[0].severity, step_px < 1 ? Severity::warning : Severity::error) << found[0].sentence;
    EXPECT_THAT(found[0].sentence,
                HasSubstr(fmt::format("px between f{:02}.png and f{:02}.png, in one push between f{:02}.png and "
                                      "f{:02}.png or over several frames",
                                      pushed - 3, pushed + 2, pushed - 1, pushed)));
  }
}

TEST(MotionCheck, WhiteAndBlackAreAPairLikeTheOthers) {
  SyntheticSequence sequence = synthetic_sequence();
  for (const std::size_t i : {32U, 33U}) shift(sequence.frames[i], 1.2, -0.9);
  const auto found = findings(sequence);
  ASSERT_EQ(found.size(), 1U);
  EXPECT_THAT(found[0].sentence, HasSubstr("between f30.png and f33.png: take the station again"));
}

TEST(MotionCheck, NoticesACreep) {
  SyntheticSequence sequence = synthetic_sequence();
  for (std::size_t i = 0; i < sequence.frames.size(); ++i) shift(sequence.frames[i], 0.02 * static_cast<double>(i), 0);
  const auto found = findings(sequence);
  ASSERT_EQ(found.size(), 1U);
  EXPECT_THAT(found[0].sentence, HasSubstr("crept by about"));
  EXPECT_THAT(found[0].sentence, HasSubstr("between f00.png and f33.png"));
}

TEST(MotionCheck, ALampThatFadesIsNoMotion) {
  SyntheticSequence sequence = synthetic_sequence();
  for (std::size_t i = 0; i < sequence.frames.size(); ++i) {
    sequence.frames[i].image *= 1 - 0.01 * static_cast<double>(i);
  }
  EXPECT_TRUE(findings(sequence).empty());
}

}  // namespace
}  // namespace crumple
