#include "tracking/hand_eye_residuals.h"

#include <random>

#include <gtest/gtest.h>

#include "tests/tracking/made_hand_eye.h"

namespace crumple {
namespace {

// How the pair stands a little later.
PosePair later(PosePair pair, double seconds) {
  const auto move = [seconds](Pose& pose, const PoseRate& rate) {
    Vector6d step;
    step << rate.angular_rad_s, rate.linear_mm_s;
    pose = retract(pose, seconds * step);
  };
  move(pair.world_from_hand, pair.hand_rate);
  move(pair.board_from_eye, pair.eye_rate);
  return pair;
}

HandEyeState stepped(const HandEyeState& state, Eigen::Index parameter, double size) {
  Eigen::Matrix<double, 13, 1> step = Eigen::Matrix<double, 13, 1>::Zero();
  step[parameter] = size;
  return {retract(state.hand_from_eye, step.head<6>()), retract(state.world_from_board, step.segment<6>(6)), 0};
}

PosePair moving_pair(const MadeHandEye& made) {
  PosePair pair = made.pairs[2];
  pair.hand_rate = {{0.4, -0.2, 0.7}, {90, -40, 30}};
  pair.eye_rate = {{-0.3, 0.5, 0.1}, {20, 60, -80}};
  return pair;
}

TEST(HandEyeResiduals, AreZeroAtTheTruth) {
  std::mt19937 random(5);
  const MadeHandEye made = make_hand_eye({}, random);
  for (const PosePair& pair : made.pairs) {
    const HandEyeResidual r = residual_of(pair, {made.hand_from_eye, made.world_from_board, 0});
    EXPECT_LT(r.rotation_rad.norm(), 1e-12);
    EXPECT_LT(r.position_mm.norm(), 1e-9);
  }
}

TEST(HandEyeResiduals, JacobiansMatchDifferences) {
  std::mt19937 random(6);
  const MadeHandEye made = make_hand_eye({.eye_sigma_deg = 8, .eye_sigma_mm = 30}, random);
  const PosePair pair = moving_pair(made);
  const HandEyeState state{made.hand_from_eye, made.world_from_board, 0};
  const HandEyeNoise noise{0.01, 2, 0.3};
  const HandEyeResidual residual = residual_of(pair, state);
  const WhiteResidual white = whitened(residual, noise, residual.lever_mm);
  for (Eigen::Index p = 0; p < kHandEyeParameters; ++p) {
    const double h = 1e-5;
    const auto at = [&](double size) {
      const PosePair moved = p == 12 ? later(pair, size) : pair;
      return whitened(residual_of(moved, p == 12 ? state : stepped(state, p, size)), noise, residual.lever_mm).value;
    };
    const Vector6d numeric = (at(h) - at(-h)) / (2 * h);
    EXPECT_LT((numeric - white.jacobian.col(p)).norm(), 1e-6 * (1 + numeric.norm())) << p;
  }
}

// With errors of all three kinds, the whitened residuals at the truth have unit covariance.
TEST(HandEyeResiduals, WhiteningLeavesUnitCovariance) {
  std::mt19937 random(7);
  const MadeHandEye made = make_hand_eye(
      {.poses = 6000, .hand_sigma_deg = 0.4, .hand_sigma_mm = 1.5, .eye_sigma_deg = 0.3, .eye_sigma_mm = 2}, random);
  const double degree = std::acos(-1.0) / 180;
  const HandEyeNoise noise{0.5 * degree, 2.5, 0.64};
  Matrix6d covariance = Matrix6d::Zero();
  for (const PosePair& pair : made.pairs) {
    const HandEyeResidual r = residual_of(pair, {made.hand_from_eye, made.world_from_board, 0});
    const Vector6d white = whitened(r, noise, r.lever_mm).value;
    covariance += white * white.transpose() / 6000;
  }
  EXPECT_LT((covariance - Matrix6d::Identity()).cwiseAbs().maxCoeff(), 0.08) << covariance;
}

}  // namespace
}  // namespace crumple
