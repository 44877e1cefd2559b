#include "tracking/board_scatter.h"

#include <gtest/gtest.h>

namespace crumple {
namespace {

// Two boards 6 mm and 0.2 rad apart lie 3 mm and 0.1 rad from their mean.
TEST(BoardScatter, IsTheDistanceFromTheMean) {
  std::vector<PosePair> pairs(3);
  pairs[1].world_from_hand = {rotation_from_vector({0, 0.2, 0}), {0, 6, 0}};
  pairs[2].world_from_hand.translation.x() = 1000;
  const BoardScatter scatter = board_scatter(pairs, {1, 1, 0}, {});
  EXPECT_EQ(scatter.pairs, 2U);
  EXPECT_NEAR(scatter.rms_mm, 3, 1e-12);
  EXPECT_NEAR(scatter.rms_rad, 0.1, 1e-9);
  EXPECT_GT(board_scatter(pairs, {}, {}).rms_mm, 400);
  pairs.resize(7);
  EXPECT_NEAR(board_scatter(pairs, {}, {}).median_mm, 0, 1e-12);
}

TEST(BoardScatter, AHandEyePoseSwingsTheBoard) {
  std::vector<PosePair> pairs(2);
  pairs[1].world_from_hand.rotation = rotation_from_vector({0, 0, 3.14159265358979});
  EXPECT_NEAR(board_scatter(pairs, {}, {Eigen::Quaterniond::Identity(), {10, 0, 0}}).rms_mm, 10, 1e-9);
}

}  // namespace
}  // namespace crumple
