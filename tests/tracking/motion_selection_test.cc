#include "tracking/motion_selection.h"

#include <gtest/gtest.h>

#include "tests/tracking/made_hand_eye.h"

namespace crumple {
namespace {

TEST(MotionSelection, LeavesOutMotionsInWhichHandAndEyeDisagree) {
  std::mt19937 random(1);
  MadeHandEye made = make_hand_eye({.poses = 12, .eye_sigma_deg = 0.05, .eye_sigma_mm = 0.2}, random);
  made.pairs[4].board_from_eye.rotation = made.pairs[4].board_from_eye.rotation * rotation_from_vector({0, 0.5, 0.2});
  const SelectedMotions selected = select_motions(made.pairs);
  EXPECT_EQ(selected.candidates, 66U);
  EXPECT_GE(selected.contradictory, 8U);
  EXPECT_LE(selected.contradictory, 14U);
  EXPECT_LT(conditioning_of(selected.motions).disagreement_rad, 0.01);
}

// Of a recording that mostly turns about one axis, the few other turns are among the motions.
TEST(MotionSelection, SeeksLargeRotationsAboutDifferentAxes) {
  std::mt19937 random(2);
  MadeHandEye made = make_hand_eye({.poses = 400, .turn_deg = 50, .spread_deg = 2}, random);
  for (const std::size_t i : {100, 200, 300}) {
    const Pose turn{rotation_from_vector(0.01 * static_cast<double>(i) * Eigen::Vector3d(0.2, -0.1, 0.3)), {5, 6, 7}};
    PosePair other = made.pairs[i];
    other.world_from_hand = other.world_from_hand * turn;
    other.board_from_eye = other.board_from_eye * made.hand_from_eye.inverse() * turn * made.hand_from_eye;
    made.pairs.push_back(other);
  }
  const SelectedMotions selected = select_motions(made.pairs);
  ASSERT_FALSE(selected.motions.empty());
  EXPECT_LE(selected.motions.size(), 200U);
  std::vector<HandEyeMotion> neighbours;
  for (std::size_t i = 1; i < made.pairs.size(); ++i) {
    neighbours.push_back({made.pairs[i - 1].world_from_hand.inverse() * made.pairs[i].world_from_hand,
                          made.pairs[i - 1].board_from_eye.inverse() * made.pairs[i].board_from_eye});
  }
  EXPECT_GT(conditioning_of(selected.motions).turn_rad, conditioning_of(neighbours).turn_rad);
  EXPECT_GT(conditioning_of(selected.motions).cross_turn_rad, 2 * conditioning_of(neighbours).cross_turn_rad);
}

TEST(MotionSelection, HasNothingToChooseFromNothing) { EXPECT_TRUE(select_motions({}).motions.empty()); }

}  // namespace
}  // namespace crumple
