#include "solvers/closed_form/hand_eye.h"

#include <cmath>
#include <numbers>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

namespace crumple {
namespace {

const Pose kTruth{rotation_from_vector({0.7, -1.9, 0.4}), {70, -40, 25}};

HandEyeMotion motion_by(const Eigen::Vector3d& turn_rad, const Eigen::Vector3d& shift_mm, const Pose& hand_from_eye) {
  const Pose hand{rotation_from_vector(turn_rad), shift_mm};
  return {hand, hand_from_eye.inverse() * hand * hand_from_eye};
}

// Two rotations about different axes are all it takes.
std::vector<HandEyeMotion> two_motions(const Pose& truth) {
  return {motion_by({0.8, 0.1, 0}, {100, -30, 60}, truth), motion_by({0, -0.5, 0.6}, {-20, 90, 10}, truth)};
}

void expect_pose(const Pose& found, const Pose& truth) {
  const Vector6d step = local_step(found, truth);
  EXPECT_LT(step.head<3>().norm(), 1e-10);
  EXPECT_LT(step.tail<3>().norm(), 1e-8);
}

TEST(HandEye, RecoversThePoseFromTwoMotions) {
  const auto start = hand_eye_start(two_motions(kTruth));
  ASSERT_TRUE(start) << start.error().message;
  expect_pose(start->hand_from_eye, kTruth);
  EXPECT_LT(start->axis_rms_rad, 1e-12);
}

RC_GTEST_PROP(HandEye, RecoversAnyPose, ()) {
  const auto number = [](int limit) { return 0.001 * *rc::gen::inRange(-1000 * limit, 1000 * limit + 1); };
  const Eigen::Vector3d turn(number(1), number(1), number(1)), shift(number(500), number(500), number(500));
  const Pose truth{rotation_from_vector(3 * turn), shift};
  const auto start = hand_eye_start(two_motions(truth));
  RC_ASSERT(start.has_value());
  const Vector6d step = local_step(start->hand_from_eye, truth);
  RC_ASSERT(step.head<3>().norm() < 1e-9);
  RC_ASSERT(step.tail<3>().norm() < 1e-6);
}

TEST(HandEye, TakesEitherSignOfAQuaternion) {
  std::vector<HandEyeMotion> motions = two_motions(kTruth);
  motions[0].hand.rotation.coeffs() *= -1;
  motions[1].eye.rotation.coeffs() *= -1;
  const auto start = hand_eye_start(motions);
  ASSERT_TRUE(start) << start.error().message;
  expect_pose(start->hand_from_eye, kTruth);
}

TEST(HandEye, AMotionByHalfATurnHarmsNothing) {
  std::vector<HandEyeMotion> motions = two_motions(kTruth);
  motions.push_back(motion_by({0, 0, std::numbers::pi}, {5, 6, 7}, kTruth));
  motions.back().eye.rotation.coeffs() *= -1;
  const auto start = hand_eye_start(motions);
  ASSERT_TRUE(start) << start.error().message;
  expect_pose(start->hand_from_eye, kTruth);
}

TEST(HandEye, RefusesParallelAxesByName) {
  std::vector<HandEyeMotion> motions;
  for (int i = 1; i < 6; ++i) motions.push_back(motion_by({0, 0, 0.3 * i}, {30.0 * i, -10, 5.0 * i * i}, kTruth));
  const auto start = hand_eye_start(motions);
  ASSERT_FALSE(start);
  EXPECT_THAT(start.error().message, testing::HasSubstr("axes are parallel: about (0.00, 0.00, 1.00)"));
}

TEST(HandEye, RefusesPureTranslationByName) {
  std::vector<HandEyeMotion> motions;
  for (int i = 1; i < 6; ++i) motions.push_back(motion_by({0, 0, 0}, {30.0 * i, -10, 5.0 * i * i}, kTruth));
  const auto start = hand_eye_start(motions);
  ASSERT_FALSE(start);
  EXPECT_THAT(start.error().message, testing::HasSubstr("rotations are too small"));
}

// Two degrees are plenty for exact poses, and nothing where hand and eye disagree by more.
TEST(HandEye, RefusesRotationsThatDrownInTheNoise) {
  std::vector<HandEyeMotion> motions;
  for (int i = 0; i < 8; ++i) {
    motions.push_back(motion_by({0.03 * std::cos(i), 0.03 * std::sin(i), 0}, {30.0 * i, -10, 5}, kTruth));
  }
  EXPECT_TRUE(hand_eye_start(motions));
  for (std::size_t i = 0; i < motions.size(); ++i) {
    const double angle = i % 2 == 0 ? 0.03 : -0.03;
    motions[i].eye.rotation = rotation_from_vector(rotation_vector(motions[i].eye.rotation) * (1 + angle / 0.04));
  }
  const auto start = hand_eye_start(motions);
  ASSERT_FALSE(start);
  EXPECT_THAT(start.error().message, testing::HasSubstr("rotations are too small"));
}

TEST(HandEye, RefusesASingleMotion) { EXPECT_FALSE(hand_eye_start({two_motions(kTruth).front()})); }

}  // namespace
}  // namespace crumple
