#include "datasets/check_capture.h"

#include <filesystem>
#include <fstream>
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include "datasets/board_check.h"
#include "datasets/exposure_check.h"
#include "datasets/sequence_check.h"
#include "tests/datasets/public_data.h"
#include "tests/datasets/synthetic_frames.h"
#include "tests/temporary_folder.h"

namespace crumple {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

constexpr const char* kDescription = R"(schema: crumple-capture/1
title: A tilted plane
sensors:
  cam: {kind: camera, size_px: [420, 330], files: "{station}/f{frame:02}.png"}
  proj: {kind: projector, size_px: [256, 192]}
patterns:
  projector: proj
  orientations:
    - {angle_deg: 0, stripe_width_px: 1, bits: 8}
    - {angle_deg: 90, stripe_width_px: 1, bits: 8}
frames: [{stripes: 0}, {stripes: 1}, white, black]
stations: [one]
)";

// A capture on disk whose files tests spoil.
class CheckCapture : public ::testing::Test {
 protected:
  void SetUp() override {
    static const SyntheticSequence sequence = synthetic_sequence();
    std::ofstream(folder_.path() / "capture.yaml") << kDescription;
    std::filesystem::create_directory(folder_.path() / "one");
    for (const ShownFrame& frame : sequence.frames) {
      ASSERT_TRUE(cv::imwrite(file(frame.name).string(), frame.image));
    }
  }

  std::filesystem::path file(const std::string& name) const { return folder_.path() / "one" / name; }

  Expected<Capture> capture() const { return read_capture(folder_.path() / "capture.yaml"); }

  // Severity and text of every finding, one a line.
  std::string findings() const {
    const auto description = capture();
    if (!description) return description.error().message;
    std::string all;
    for (const Finding& finding : check_capture(*description)) {
      all += (finding.severity == Severity::error ? "error: " : "warning: ") + finding.where + ": " + finding.sentence +
             "\n";
    }
    return all;
  }

  TemporaryFolder folder_;
};

TEST_F(CheckCapture, FindsNothingInACleanCapture) {
  EXPECT_EQ(findings(), "");
  const auto description = capture();
  ASSERT_TRUE(description) << description.error().message;
  const auto stripes = read_stripe_images(*description, "cam", "one");
  ASSERT_TRUE(stripes) << stripes.error().message;
  const auto expected = synthetic_sequence();
  EXPECT_EQ(cv::norm(stripes->stacks[1].inverses[2], expected.frames[21].image, cv::NORM_INF), 0);
  EXPECT_EQ(cv::norm(stripes->white, expected.frames[32].image, cv::NORM_INF), 0);
  EXPECT_EQ(stripes->projector, (ImageSize{256, 192}));
}

TEST_F(CheckCapture, NamesAMissingFile) {
  std::filesystem::remove(file("f05.png"));
  EXPECT_THAT(findings(), AllOf(HasSubstr("error: station one, camera cam"), HasSubstr("f05.png does not exist")));
  const auto stripes = read_stripe_images(*capture(), "cam", "one");
  ASSERT_FALSE(stripes);
  EXPECT_THAT(stripes.error().message, HasSubstr("f05.png does not exist"));
}

TEST_F(CheckCapture, NamesATruncatedFile) {
  std::filesystem::resize_file(file("f11.png"), std::filesystem::file_size(file("f11.png")) / 2);
  EXPECT_THAT(findings(), HasSubstr("f11.png is truncated"));
}

TEST_F(CheckCapture, NamesAnImageOfAnotherSize) {
  cv::imwrite(file("f11.png").string(), cv::Mat(100, 100, CV_8U, cv::Scalar(9)));
  EXPECT_THAT(findings(), HasSubstr("f11.png is 100 x 100 px, but camera cam has 420 x 330"));
}

TEST_F(CheckCapture, NamesAnImageOfAnotherDepth) {
  cv::Mat image = cv::imread(file("f11.png").string(), cv::IMREAD_UNCHANGED);
  image.convertTo(image, CV_16U, 257);
  cv::imwrite(file("f11.png").string(), image);
  EXPECT_THAT(findings(), HasSubstr("f11.png has 16 bit values, most other frames of the station 8"));
}

TEST_F(CheckCapture, NamesADroppedFrame) {
  for (int i = 21; i < 33; ++i) {
    std::filesystem::rename(file(fmt::format("f{:02}.png", i + 1)), file(fmt::format("f{:02}.png", i)));
  }
  EXPECT_THAT(findings(), AllOf(HasSubstr("f33.png does not exist"), HasSubstr("a frame was dropped: what f21.png")));
}

TEST_F(CheckCapture, NamesADarkAndASaturatedFrame) {
  cv::imwrite(file("f32.png").string(), cv::Mat(330, 420, CV_8U, cv::Scalar(0)));
  EXPECT_THAT(findings(), HasSubstr("f32.png (white) is dark"));
  cv::imwrite(file("f32.png").string(), cv::Mat(330, 420, CV_8U, cv::Scalar(255)));
  EXPECT_THAT(findings(), HasSubstr("error: station one, camera cam: f32.png (white) is saturated in 100.0 %"));
}

TEST_F(CheckCapture, LeavesExcludedStationsAlone) {
  std::string text = kDescription;
  text.replace(text.find("stations: [one]"), 15, "stations: [one, two]\nexclude: [{station: two, reason: moved}]");
  std::ofstream(folder_.path() / "capture.yaml") << text;
  EXPECT_EQ(findings(), "");
}

TEST_F(CheckCapture, NoticesTheSameImagesAtTwoStations) {
  std::string text = kDescription;
  text.replace(text.find("stations: [one]"), 15, "stations: [one, two]");
  std::ofstream(folder_.path() / "capture.yaml") << text;
  std::filesystem::copy(folder_.path() / "one", folder_.path() / "two");
  EXPECT_THAT(findings(), HasSubstr("station two, camera cam: holds the same images as station one"));
}

TEST_F(CheckCapture, SaysThatNothingIsLeft) {
  std::ofstream(folder_.path() / "capture.yaml") << kDescription << "exclude: [{station: one, reason: moved}]\n";
  EXPECT_THAT(findings(), HasSubstr("every station is excluded"));
}

// The same faults made in real images, whose finest stripes are blurred and whose darkest squares hold little light.
TEST(CheckRealImages, NamesFaultsMadeInProcam) {
  const auto data = public_data("procam");
  if (!data) GTEST_SKIP() << "the procam images are not here; name their parent folder in CRUMPLE_DATA";
  const auto capture = read_capture(std::filesystem::path(CRUMPLE_SOURCE_DIR) / "datasets/examples/procam.yaml", *data);
  ASSERT_TRUE(capture) << capture.error().message;
  const StationFrames station = check_station(*capture, "camera", "1");
  SequenceSetup setup{capture->orientations, {1024, 768}, 255, "station 1"};
  std::vector<ShownFrame> clean;
  for (std::size_t i = 0; i < station.images.size(); ++i) {
    clean.push_back({capture->frames[i], fmt::format("f{:02}.png", i), station.images[i]});
  }
  const auto sentence = [&](const std::vector<ShownFrame>& frames) {
    const std::vector<Finding> findings = check_sequence(frames, setup);
    return findings.size() == 1 ? findings[0].sentence : fmt::format("{} findings", findings.size());
  };
  for (const auto& [a, b] : {std::pair{0, 1}, {18, 19}, {20, 21}, {38, 39}, {7, 31}, {16, 18}, {40, 41}}) {
    std::vector<ShownFrame> frames = clean;
    std::swap(frames[a].image, frames[b].image);
    EXPECT_THAT(sentence(frames), AllOf(HasSubstr(clean[a].name), HasSubstr(clean[b].name), HasSubstr("swapped")));
  }
  for (const std::size_t dropped : {11, 27}) {
    std::vector<ShownFrame> frames = clean;
    for (std::size_t i = dropped; i < 41; ++i) frames[i].image = clean[i + 1].image;
    frames[41].image = cv::Mat();
    EXPECT_THAT(sentence(frames), HasSubstr("a frame was dropped: what " + clean[dropped].name));
  }
}

cv::Mat drawn_board(cv::Size squares, int side_px) {
  cv::Mat image((squares.height + 2) * side_px, (squares.width + 2) * side_px, CV_8U, cv::Scalar(200));
  for (int y = 0; y < squares.height; ++y) {
    for (int x = 0; x < squares.width; ++x) {
      const cv::Rect square((x + 1) * side_px, (y + 1) * side_px, side_px, side_px);
      if ((x + y) % 2 == 0) image(square).setTo(30);
    }
  }
  return image;
}

TEST(BoardCheck, NoticesABoardTheProjectorDoesNotLight) {
  const BoardSpec board{"board", {8, 5, 10}, {}};
  const cv::Mat white = drawn_board({9, 6}, 40);
  cv::Mat black = white * 0.1;
  const auto findings = [&] {
    return check_board({{{FrameContent::Kind::white, 0, 0, false}, "w.png", white},
                        {{FrameContent::Kind::black, 0, 0, false}, "k.png", black}},
                       board, 1, 255, "here");
  };
  EXPECT_TRUE(findings().empty());
  // Room light shows the board; the projector lights the margin only.
  white.copyTo(black);
  black.rowRange(0, 40).setTo(0);
  ASSERT_EQ(findings().size(), 1U);
  EXPECT_EQ(findings()[0].severity, Severity::error);
  EXPECT_THAT(findings()[0].sentence, HasSubstr("lights none of the board"));
}

TEST(BoardCheck, WarnsWhereNoBoardIsFound) {
  const cv::Mat grey(300, 400, CV_8U, cv::Scalar(90));
  const auto findings = check_board({{{FrameContent::Kind::ambient, 0, 0, false}, "a.png", grey}},
                                    {"board", {8, 5, 10}, {}}, 1, 255, "here");
  ASSERT_EQ(findings.size(), 1U);
  EXPECT_EQ(findings[0].severity, Severity::warning);
  EXPECT_THAT(findings[0].sentence, HasSubstr("the board's view in a.png will not be used: no chessboard with 8 x 5"));
}

TEST(ExposureCheck, KnowsTheScaleOfDeepImages) {
  const auto scale = [](int type, double value) {
    return full_scale_of({{{}, "f", cv::Mat(4, 4, type, cv::Scalar(value))}});
  };
  EXPECT_EQ(scale(CV_8U, 3), 255);
  EXPECT_EQ(scale(CV_16U, 900), 1023);
  EXPECT_EQ(scale(CV_16U, 4095), 4095);
  EXPECT_EQ(scale(CV_16U, 4096), 16383);
  EXPECT_EQ(scale(CV_16U, 65520), 65535);
}

TEST(ExposureCheck, WarnsOfGlintsAndDimLight) {
  cv::Mat image(100, 100, CV_8U, cv::Scalar(90));
  image.rowRange(0, 2).setTo(255);
  const ShownFrame glint{{FrameContent::Kind::white, 0, 0, false}, "w.png", image};
  auto findings = check_exposure({glint}, 255, "here");
  ASSERT_EQ(findings.size(), 1U);
  EXPECT_EQ(findings[0].severity, Severity::warning);
  EXPECT_EQ(findings[0].sentence, "w.png (white) is saturated in 2.0 % of its pixels; expose shorter or stop down");

  const ShownFrame dim{{FrameContent::Kind::ambient, 0, 0, false}, "a.png", cv::Mat(9, 9, CV_8U, cv::Scalar(20))};
  findings = check_exposure({dim}, 255, "here");
  ASSERT_EQ(findings.size(), 1U);
  EXPECT_THAT(findings[0].sentence, HasSubstr("a.png (ambient light) is dim"));

  // 12 bit data shifted to the top of 16 never reach 65535.
  const ShownFrame shifted{{FrameContent::Kind::white, 0, 0, false}, "w.png", cv::Mat(9, 9, CV_16U, cv::Scalar(65520))};
  findings = check_exposure({shifted}, 65535, "here");
  ASSERT_EQ(findings.size(), 1U);
  EXPECT_EQ(findings[0].severity, Severity::error);
}

// Two stations of one tracker, four images each.
class CheckTrackers : public CheckCapture {
 protected:
  void SetUp() override {
    std::ofstream(folder_.path() / "capture.yaml")
        << "schema: crumple-capture/3\ntitle: trackers\nsensors:\n"
           "  t: {kind: camera, mount: world, size_px: [64, 48], files: \"one/{station}_{frame}.png\"}\n"
           "leds: {a: {word: \"011\"}}\ntracker_frames: [ambient, {leds: 3}]\nstations: [x, y]\n";
    std::filesystem::create_directory(folder_.path() / "one");
    for (const std::string station : {"x", "y"}) {
      for (int frame = 0; frame < 4; ++frame) {
        cv::Mat image(48, 64, CV_8U, cv::Scalar(frame == 0 ? 90 : 3));
        image.at<std::uint8_t>(20, station == "x" ? 10 : 40) = 200;
        ASSERT_TRUE(cv::imwrite(file(station + "_" + std::to_string(frame) + ".png").string(), image));
      }
    }
  }
};

TEST_F(CheckTrackers, DarkImagesOfTheBlinkingAreNoFault) { EXPECT_EQ(findings(), ""); }

TEST_F(CheckTrackers, AMissingImageOfTheBlinkingIsAnErasure) {
  std::filesystem::remove(file("x_2.png"));
  EXPECT_THAT(findings(), AllOf(HasSubstr("warning: station x, camera t"), HasSubstr("x_2.png does not exist"),
                                Not(HasSubstr("error"))));
  std::filesystem::remove(file("x_1.png"));
  std::filesystem::remove(file("x_3.png"));
  EXPECT_THAT(findings(), HasSubstr("error: station x, camera t: has no image of the blinking sequence"));
}

TEST_F(CheckTrackers, OtherMissingOrSpoiltImagesAreErrors) {
  std::filesystem::remove(file("y_0.png"));
  std::ofstream(file("x_1.png")) << "no image";
  EXPECT_THAT(findings(), AllOf(HasSubstr("error: station y, camera t"), HasSubstr("error: station x, camera t")));
}

}  // namespace
}  // namespace crumple
