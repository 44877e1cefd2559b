#include "calib/detect_target.h"

#include <cmath>
#include <iostream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <opencv2/imgproc.hpp>

#include "tests/calib/drawn_target.h"

namespace crumple {
namespace {

using testing::HasSubstr;

const Target kChessboard{9, 6, 25};
const Target kCharuco{9, 6, 25, TargetKind::charuco, 19, "5X5_100", 20};
const Target kAprilTags{6, 4, 45, TargetKind::apriltag, 36, "APRILTAG_36h11"};
const Target kDots{9, 7, 26, TargetKind::dots, 13};
const Target kStaggered{5, 11, 48, TargetKind::dots, 15, {}, 0, true};

const std::vector<Eigen::Vector3d> kTurns = {{0, 0, 0.1}, {0.5, 0.1, 0.2}, {-0.2, -0.6, -0.1}};

cv::Mat picture_of(const Target& target, const Pose& pose) {
  cv::Mat1f scene = blank(drawing_lens().size());
  draw_target(target, drawing_lens(), pose, scene);
  return photographed(scene, {});
}

struct Errors {
  double rms = 0;  // of the length of the error vector, px
  double worst = 0;
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
};

Errors errors_of(const DetectedBoard& found, const Board& board, const Pose& pose) {
  Errors errors;
  double squares = 0;
  for (std::size_t i = 0; i < found.corners.size(); ++i) {
    const Eigen::Vector2d error = found.pixels[i] - true_pixel(board, found.corners[i], drawing_lens(), pose);
    squares += error.squaredNorm();
    errors.mean += error / static_cast<double>(found.corners.size());
    errors.worst = std::max(errors.worst, error.norm());
  }
  errors.rms = std::sqrt(squares / static_cast<double>(found.corners.size()));
  return errors;
}

class EveryTarget : public testing::TestWithParam<Target> {};

TEST_P(EveryTarget, IsFoundWhereItIs) {
  const Board board = board_of(GetParam());
  for (const Eigen::Vector3d& turn : kTurns) {
    const Pose pose = drawing_pose(GetParam(), 480, turn);
    const auto found = detect_target(picture_of(GetParam(), pose), GetParam());
    ASSERT_TRUE(found) << turn.transpose() << ": " << found.error().message;
    EXPECT_GT(found->corners.size(), 0.95 * board.point_count()) << turn.transpose();
    const Errors errors = errors_of(*found, board, pose);
    EXPECT_LT(errors.rms, 0.04) << turn.transpose();
    EXPECT_LT(errors.mean.norm(), 0.01) << turn.transpose();
    std::cout << words(GetParam()) << ": RMS " << errors.rms << " px, worst " << errors.worst << ", mean "
              << errors.mean.transpose() << ", " << found->corners.size() << " of " << board.point_count() << "\n";
  }
}

INSTANTIATE_TEST_SUITE_P(Targets, EveryTarget, testing::Values(kChessboard, kCharuco, kAprilTags, kDots, kStaggered));

// The two differ by what perspective and distortion do to a circle.
TEST(DetectDots, TheDiscsCentreIsNotWhereItsImagesIs) {
  const Target large{7, 5, 36, TargetKind::dots, 22};
  const Pose pose = drawing_pose(large, 480, {0.1, 0.75, 0});
  const Board board = board_of(large);
  const auto found = detect_target(picture_of(large, pose), large);
  ASSERT_TRUE(found) << found.error().message;
  double squares = 0;
  for (std::size_t i = 0; i < found->corners.size(); ++i) {
    const Eigen::Vector2d centre = drawing_lens().project(pose * board.point(found->corners[i])).value();
    squares += (found->pixels[i] - centre).squaredNorm();
  }
  EXPECT_GT(std::sqrt(squares / static_cast<double>(found->corners.size())), 0.1);
  EXPECT_LT(errors_of(*found, board, pose).rms, 0.03);
}

TEST(DetectDots, AreReadFromAnySide) {
  const Pose turned = drawing_pose(kStaggered, 480, {0.2, 0, 3});
  const auto found = detect_target(picture_of(kStaggered, turned), kStaggered);
  ASSERT_TRUE(found) << found.error().message;
  EXPECT_LT(errors_of(*found, board_of(kStaggered), turned).worst, 0.2);
}

// Without markers it has no origin.
TEST(DetectDots, APartIsLeftOutWithAReasonThatSaysSo) {
  Pose pose = drawing_pose(kDots, 480, {0.1, 0, 0});
  pose.translation.x() += 170;
  const auto found = detect_target(picture_of(kDots, pose), kDots);
  ASSERT_FALSE(found);
  EXPECT_THAT(found.error().message,
              HasSubstr("no grid of 9 x 7 dots found: all of it must be in view, for a part without markers cannot be "
                        "told from another"));
}

class CodedTarget : public testing::TestWithParam<Target> {};

TEST_P(CodedTarget, SurvivesOcclusionAndTheImagesBorder) {
  const Pose pose = drawing_pose(GetParam(), 300, {0.3, -0.2, 0.1});
  cv::Mat image = picture_of(GetParam(), pose);
  cv::ellipse(image, {300, 250}, {150, 110}, 20, 0, 360, cv::Scalar(120), cv::FILLED);
  const auto found = detect_target(image, GetParam());
  ASSERT_TRUE(found) << found.error().message;
  EXPECT_GT(found->corners.size(), 10U);
  EXPECT_FALSE(found->complete(board_of(GetParam())));
  EXPECT_LT(errors_of(*found, board_of(GetParam()), pose).worst, 0.25);
}

TEST_P(CodedTarget, SaysWhatIsWrong) {
  const cv::Mat image = picture_of(GetParam(), drawing_pose(GetParam(), 480, {0.2, 0.1, 0}));
  const auto reason = [&](const auto& change) {
    Target wrong = GetParam();
    change(wrong);
    const auto found = detect_target(image, wrong);
    return found ? std::string("found") : found.error().message;
  };
  EXPECT_THAT(reason([](Target& t) { t.dictionary = "7X7_250"; }), HasSubstr("no marker of the dictionary 7X7_250"));
  EXPECT_THAT(reason([](Target& t) { t.first_id = 60; }), HasSubstr("none of this board's, 60 to"));
  EXPECT_THAT(reason([](Target& t) { t.columns -= 2; }), HasSubstr("not where it has them"));
  EXPECT_THAT(reason([](Target& t) { t.mark_mm *= 0.6; }), HasSubstr("times as large"));
  EXPECT_FALSE(detect_target(cv::Mat(480, 640, CV_8U, cv::Scalar(128)), GetParam()));
}

INSTANTIATE_TEST_SUITE_P(Targets, CodedTarget, testing::Values(kCharuco, kAprilTags));

TEST(DetectTarget, TellsTwoBoardsInOneImageApart) {
  const Target left{4, 5, 25, TargetKind::charuco, 19, "5X5_100"};
  Target right = left;
  right.first_id = 15;
  Pose of_left = drawing_pose(left, 500, {0.1, 0.3, 0}), of_right = drawing_pose(right, 520, {0, -0.3, 0.1});
  of_left.translation.x() -= 95;
  of_right.translation.x() += 95;
  cv::Mat1f scene = blank(drawing_lens().size());
  draw_target(left, drawing_lens(), of_left, scene);
  draw_target(right, drawing_lens(), of_right, scene);
  const cv::Mat image = photographed(scene, {});
  for (const auto& [target, pose] : {std::pair{left, of_left}, {right, of_right}}) {
    const auto found = detect_target(image, target);
    ASSERT_TRUE(found) << found.error().message;
    EXPECT_GT(found->corners.size(), 18U);
    EXPECT_LT(errors_of(*found, board_of(target), pose).worst, 0.2);
  }
}

}  // namespace
}  // namespace crumple
