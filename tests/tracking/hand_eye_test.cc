#include "tracking/hand_eye.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <Eigen/Cholesky>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/tracking/made_hand_eye.h"
#include "tracking/hand_eye_verdict.h"

namespace crumple {
namespace {

void expect_exact(const HandEyeCalibration& found, const Pose& truth, double limit_rad, double limit_mm) {
  const Vector6d step = local_step(found.fit.state.hand_from_eye, truth);
  EXPECT_LT(step.head<3>().norm(), limit_rad);
  EXPECT_LT(step.tail<3>().norm(), limit_mm);
}

PairedStreams paired(const MadeStreams& made) {
  return {*PoseStream::create(made.hand), *PoseStream::create(made.eye)};
}

// The error's square by its covariance: 6 on average.
double misfit(const HandEyeFit& fit, const Pose& truth) {
  const Vector6d step = local_step(fit.state.hand_from_eye, truth);
  return step.dot(Matrix6d(fit.covariance.topLeftCorner<6, 6>()).ldlt().solve(step));
}

TEST(CalibrateHandEye, RecoversExactPairs) {
  std::mt19937 random(1);
  for (int i = 0; i < 10; ++i) {
    const MadeHandEye made = make_hand_eye({.poses = 3 + i}, random);
    const auto found = calibrate_hand_eye(made.pairs);
    ASSERT_TRUE(found) << found.error().message;
    expect_exact(*found, made.hand_from_eye, 1e-9, 1e-6);
    EXPECT_LT(found->scatter_all.rms_mm, 1e-6);
  }
}

TEST(CalibrateHandEye, ItsCovarianceCoversTheErrorsOfPairs) {
  std::mt19937 random(2);
  double sum = 0;
  for (int i = 0; i < 60; ++i) {
    const MadeHandEye made = make_hand_eye(
        {.poses = 25, .hand_sigma_deg = 0.1, .hand_sigma_mm = 0.2, .eye_sigma_deg = 0.2, .eye_sigma_mm = 1}, random);
    const auto found = calibrate_hand_eye(made.pairs);
    ASSERT_TRUE(found) << found.error().message;
    EXPECT_TRUE(judge(*found).ok);
    sum += misfit(found->fit, made.hand_from_eye) / 60;
  }
  EXPECT_GT(sum, 4);
  EXPECT_LT(sum, 9);
}

TEST(CalibrateHandEye, LeavesWrongPosesOut) {
  std::mt19937 random(3);
  MadeHandEye made = make_hand_eye({.poses = 40, .eye_sigma_deg = 0.1, .eye_sigma_mm = 0.5}, random);
  for (const std::size_t wrong : {3, 11, 17, 30}) {
    made.pairs[wrong].board_from_eye.rotation =
        made.pairs[wrong].board_from_eye.rotation * rotation_from_vector({0, 0.4, 0});
  }
  made.pairs[22].board_from_eye.translation.x() += 80;
  const auto found = calibrate_hand_eye(made.pairs);
  ASSERT_TRUE(found) << found.error().message;
  for (const std::size_t wrong : {3, 11, 17, 22, 30}) EXPECT_EQ(found->fit.accepted[wrong], 0) << wrong;
  EXPECT_GE(found->scatter.pairs, 34U);
  EXPECT_LT(misfit(found->fit, made.hand_from_eye), 30);
}

TEST(CalibrateHandEye, FindsTheOffsetOfTwoStreams) {
  std::mt19937 random(4);
  const MadeStreams made = make_streams({.offset_s = 7.3456, .eye_sigma_deg = 0.05, .eye_sigma_mm = 0.3}, random);
  const auto found = calibrate_hand_eye(paired(made));
  ASSERT_TRUE(found) << found.error().message;
  EXPECT_NEAR(found->fit.state.offset_s, 7.3456, 2e-4);
  EXPECT_LT(std::abs(found->fit.state.offset_s - 7.3456), 4 * std::sqrt(found->fit.covariance(12, 12)) + 2e-5);
  expect_exact(*found, made.hand_from_eye, 2e-4, 0.2);
  EXPECT_TRUE(judge(*found).ok);
}

TEST(CalibrateHandEye, TheDenserStreamMayBeTheEyes) {
  std::mt19937 random(5);
  const MadeStreams made = make_streams({.offset_s = -0.5}, random);
  // Swapped roles: hand and eye, world and board trade places.
  const auto found = calibrate_hand_eye(PairedStreams(*PoseStream::create(made.eye), *PoseStream::create(made.hand)));
  ASSERT_TRUE(found) << found.error().message;
  EXPECT_NEAR(found->fit.state.offset_s, 0.5, 1e-4);
  expect_exact(*found, made.hand_from_eye.inverse(), 1e-4, 0.1);
}

// Errors that last for a second count for fewer than their number.
TEST(CalibrateHandEye, ItsCovarianceCoversTheErrorsOfCorrelatedStreams) {
  std::mt19937 random(6);
  double sum = 0, inflation = 0;
  for (int i = 0; i < 12; ++i) {
    const MadeStreams made =
        make_streams({.seconds = 40, .eye_sigma_deg = 0.3, .eye_sigma_mm = 2, .eye_correlation = 0.95}, random);
    const auto found = calibrate_hand_eye(paired(made));
    ASSERT_TRUE(found) << found.error().message;
    sum += misfit(found->fit, made.hand_from_eye) / 12;
    inflation += found->fit.correlation_inflation / 12;
  }
  EXPECT_LT(sum, 14);
  EXPECT_GT(inflation, 5);
}

TEST(CalibrateHandEye, RefusesParallelAxesUnderNoise) {
  std::mt19937 random(7);
  const MadeHandEye made =
      make_hand_eye({.poses = 30, .spread_deg = 0, .eye_sigma_deg = 0.2, .eye_sigma_mm = 0.5}, random);
  const auto found = calibrate_hand_eye(made.pairs);
  ASSERT_FALSE(found);
  EXPECT_THAT(found.error().message, testing::HasSubstr("axes are parallel"));
}

TEST(CalibrateHandEye, RefusesPureTranslationUnderNoise) {
  std::mt19937 random(8);
  const MadeHandEye made =
      make_hand_eye({.poses = 30, .turn_deg = 0, .eye_sigma_deg = 0.2, .eye_sigma_mm = 0.5}, random);
  const auto found = calibrate_hand_eye(made.pairs);
  ASSERT_FALSE(found);
  EXPECT_THAT(found.error().message, testing::HasSubstr("rotations are too small"));
}

TEST(CalibrateHandEye, DoubtsNearlyParallelAxes) {
  std::mt19937 random(9);
  const MadeHandEye made =
      make_hand_eye({.poses = 30, .spread_deg = 1.2, .eye_sigma_deg = 0.1, .eye_sigma_mm = 0.5}, random);
  const auto found = calibrate_hand_eye(made.pairs);
  ASSERT_TRUE(found) << found.error().message;
  const HandEyeVerdict verdict = judge(*found);
  EXPECT_FALSE(verdict.ok);
  EXPECT_THAT(verdict.reasons, testing::Contains(testing::HasSubstr("nearly parallel")));
}

TEST(CalibrateHandEye, NamesPosesThatAreTheWrongWayRound) {
  std::mt19937 random(10);
  MadeHandEye made = make_hand_eye({.poses = 30}, random);
  for (PosePair& pair : made.pairs) pair.board_from_eye = pair.board_from_eye.inverse();
  const auto found = calibrate_hand_eye(made.pairs);
  ASSERT_FALSE(found);
  EXPECT_THAT(found.error().message, testing::HasSubstr("the other way round"));
}

TEST(CalibrateHandEye, RefusesTooFewPairs) {
  std::mt19937 random(11);
  const MadeHandEye made = make_hand_eye({.poses = 2}, random);
  EXPECT_FALSE(calibrate_hand_eye(made.pairs));
  EXPECT_FALSE(calibrate_hand_eye(std::vector<PosePair>()));
}

}  // namespace
}  // namespace crumple
