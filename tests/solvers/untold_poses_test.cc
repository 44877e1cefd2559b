#include "solvers/untold_poses.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/solvers/synthetic.h"

namespace crumple {
namespace {

using testing::Each;
using testing::ElementsAre;
using testing::IsEmpty;

// Two corners of one board are accepted, and nothing else that was seen there.
struct Accepted {
  Synthetic made = make_synthetic({.placements = 3});
  std::vector<std::unique_ptr<View>> views = make_views(made.observations, made.truth.board_of);
  std::vector<ViewWeights> weights;
  std::set<BlockId> held;

  Accepted() {
    for (const auto& view : views) {
      const bool all = view->placement() != 1;
      weights.push_back({1, 1, std::vector<char>(static_cast<std::size_t>(view->size()), all)});
      if (!all && view->kind() == View::Kind::corners) weights.back().inlier[4] = weights.back().inlier[9] = 1;
    }
  }
};

TEST(UntoldPoses, GetANewOneFromAllThatWasSeen) {
  Accepted a;
  CalibrationState state = a.made.truth;
  state.world_from_board[1].translation.x() += 100;
  EXPECT_TRUE(settle_untold_poses(a.views, a.made.observations, true, a.weights, state, a.held));
  EXPECT_LT(local_step(a.made.truth.world_from_board[1], state.world_from_board[1]).norm(), 1e-6);
  for (const ViewWeights& weights : a.weights) EXPECT_THAT(weights.inlier, Each(1));
  EXPECT_THAT(a.held, IsEmpty());
  EXPECT_FALSE(settle_untold_poses(a.views, a.made.observations, true, a.weights, state, a.held));
}

TEST(UntoldPoses, AreGivenUpAndHeld) {
  Accepted a;
  CalibrationState state = a.made.truth;
  EXPECT_TRUE(settle_untold_poses(a.views, a.made.observations, false, a.weights, state, a.held));
  EXPECT_THAT(a.held, ElementsAre(BlockId{BlockId::Kind::placement, 1}));
  for (std::size_t v = 0; v < a.views.size(); ++v) {
    EXPECT_THAT(a.weights[v].inlier, Each(a.views[v]->placement() != 1)) << v;
  }
  EXPECT_FALSE(settle_untold_poses(a.views, a.made.observations, false, a.weights, state, a.held));
}

}  // namespace
}  // namespace crumple
