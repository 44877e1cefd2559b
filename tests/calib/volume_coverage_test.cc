#include "calib/volume_coverage.h"

#include <numeric>

#include <gtest/gtest.h>

#include "tests/solvers/synthetic.h"

namespace crumple {
namespace {

// A board before the camera's middle, one corner in each ninth of the image or none.
struct BoardsInDepth {
  CalibrationState state;
  Observations observations;
  std::vector<ViewSummary> views;

  explicit BoardsInDepth(const std::vector<double>& depths_mm) {
    const Synthetic made = make_synthetic({.placements = 1});
    state.rig.sensors = {made.truth.rig.sensors[0]};
    state.boards = made.truth.boards;
    for (const double depth_mm : depths_mm) {
      const std::size_t placement = state.world_from_board.size();
      state.world_from_board.push_back({Eigen::Quaterniond::Identity(), {0, 0, depth_mm}});
      state.board_of.push_back(0);
      observations.corners.push_back({0, placement, {0, 1}, {{500, 400}, {10, 10}}});
      ViewSummary view{};
      view.inlier = {1, 1};
      views.push_back(view);
    }
  }
};

TEST(VolumeCoverage, CountsPartsOfImageAndDepth) {
  const BoardsInDepth made({600, 610, 900});
  const auto coverage = volume_coverage(made.observations, made.state, made.views);
  ASSERT_TRUE(coverage);
  EXPECT_NEAR(coverage->near_mm, 600, 1e-9);
  EXPECT_NEAR(coverage->far_mm, 900, 1e-9);
  EXPECT_FALSE(coverage->shallow());
  EXPECT_EQ(coverage->covered(), 4);
  EXPECT_EQ(coverage->corners[0], 2U);       // near, upper left
  EXPECT_EQ(coverage->corners[4], 2U);       // near, middle
  EXPECT_EQ(coverage->corners[18 + 4], 1U);  // far, middle
  EXPECT_EQ(std::accumulate(coverage->corners.begin(), coverage->corners.end(), std::size_t{0}), 6U);
}

TEST(VolumeCoverage, LeavesOutliersOut) {
  BoardsInDepth made({600, 700, 3000});
  made.views[2].inlier = {0, 0};
  const auto coverage = volume_coverage(made.observations, made.state, made.views);
  ASSERT_TRUE(coverage);
  EXPECT_NEAR(coverage->far_mm, 700, 1e-9);
  EXPECT_TRUE(coverage->shallow());
}

TEST(VolumeCoverage, IsNoneWithoutBoards) { EXPECT_FALSE(volume_coverage({}, BoardsInDepth({600}).state, {})); }

}  // namespace
}  // namespace crumple
