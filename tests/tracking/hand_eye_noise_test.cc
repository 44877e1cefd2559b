#include "tracking/hand_eye_noise.h"

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "tests/tracking/made_hand_eye.h"

namespace crumple {
namespace {

constexpr double kDegree = std::numbers::pi / 180;

std::vector<HandEyeResidual> residuals_with(const MadeHandEyeOptions& options, unsigned seed) {
  std::mt19937 random(seed);
  const MadeHandEye made = make_hand_eye(options, random);
  std::vector<HandEyeResidual> residuals;
  for (const PosePair& pair : made.pairs) {
    residuals.push_back(residual_of(pair, {made.hand_from_eye, made.world_from_board, 0}));
  }
  return residuals;
}

TEST(HandEyeNoise, TellsTheHandsErrorsFromTheEyes) {
  const HandEyeNoise noise = most_likely_noise(residuals_with(
      {.poses = 2000, .hand_sigma_deg = 0.3, .hand_sigma_mm = 0.6, .eye_sigma_deg = 0.4, .eye_sigma_mm = 0.8}, 1));
  EXPECT_NEAR(noise.rotation_rad / kDegree, 0.5, 0.02);
  EXPECT_NEAR(noise.position_mm, 1.0, 0.05);
  EXPECT_NEAR(noise.hand_share, 0.36, 0.03);
}

TEST(HandEyeNoise, MediansDoNotMindOutliers) {
  std::vector<HandEyeResidual> residuals =
      residuals_with({.poses = 1000, .eye_sigma_deg = 0.4, .eye_sigma_mm = 0.8}, 2);
  for (std::size_t i = 0; i < 100; ++i) residuals[i].position_mm.x() += 500;
  const HandEyeNoise noise = robust_noise(residuals);
  EXPECT_NEAR(noise.rotation_rad / kDegree, 0.4, 0.04);
  EXPECT_NEAR(noise.position_mm, 0.8, 0.15);
}

}  // namespace
}  // namespace crumple
