// Which poses are eliminated, and that nothing depends on it.
#include "solvers/parameters.h"

#include <algorithm>

#include <Eigen/LU>
#include <gtest/gtest.h>

#include "solvers/covariance.h"
#include "tests/solvers/made_system.h"

namespace crumple {
namespace {

using Views = std::vector<std::unique_ptr<View>>;

std::size_t poses_in_common(const Parameters& parameters) {
  const auto& blocks = parameters.common_blocks();
  return static_cast<std::size_t>(std::count_if(blocks.begin(), blocks.end(), [](auto& b) { return b.is_pose(); }));
}

std::set<BlockId> held_by_gauge(const CalibrationState& state) {
  std::set<BlockId> held{{BlockId::Kind::mount, 0}};
  for (std::size_t s = 0; s < state.rig.sensors.size(); ++s) {
    if (state.rig.sensors[s].mount != Mount::world) continue;
    held.insert({BlockId::Kind::mount, s});
    break;
  }
  for (std::size_t b = 0; b < state.boards.size(); ++b) {
    held.insert({BlockId::Kind::warp, b});
    held.insert({BlockId::Kind::scale, b});
  }
  return held;
}

// Two placements are seen from eight stations, five by the trackers alone.
struct Tracked {
  MadeSystem made = make_system({.stations = 8, .placements = 2, .tracker_placements = 5});
  Views views = make_views(made.observations, made.truth.board_of);
};

TEST(Parameters, PlacementsThatNoStationMeetsAreEliminatedBesideTheStations) {
  const Tracked tracked;
  const Parameters parameters(tracked.made.truth, tracked.views, held_by_gauge(tracked.made.truth));
  EXPECT_EQ(poses_in_common(parameters), 2U);
  EXPECT_EQ(parameters.eliminated().size(), 8U + 5U);
  for (const auto& view : tracked.views) {
    const auto& blocks = view->blocks();
    EXPECT_LE(std::count_if(blocks.begin(), blocks.end(), [&](auto& b) { return parameters.slot(b).has_value(); }), 1);
  }
}

TEST(Parameters, AHeldPoseMeetsNoOther) {
  const Tracked tracked;
  std::set<BlockId> held = held_by_gauge(tracked.made.truth);
  for (const auto& view : tracked.views) {
    for (const BlockId& block : view->blocks()) {
      if (block.kind == BlockId::Kind::station) held.insert(block);
    }
  }
  const Parameters parameters(tracked.made.truth, tracked.views, held);
  EXPECT_EQ(poses_in_common(parameters), 0U);
  EXPECT_EQ(parameters.eliminated().size(), 7U);
}

// The whole information matrix inverted, every pose in it.
TEST(Parameters, TheCovarianceDoesNotDependOnWhatIsEliminated) {
  const Tracked tracked;
  const CalibrationState& state = tracked.made.truth;
  const Parameters parameters(state, tracked.views, held_by_gauge(state));
  const auto evaluate = [&](std::size_t v, ViewEvaluation& at) { return tracked.views[v]->evaluate(state, true, at); };
  const NormalEquations equations = NormalEquations::of(tracked.views, parameters, evaluate, 1).value();
  const auto covariance = JointCovariance::create(equations, state);
  ASSERT_TRUE(covariance) << covariance.error().message;

  std::vector<BlockId> blocks = parameters.common_blocks();
  blocks.insert(blocks.end(), parameters.eliminated().begin(), parameters.eliminated().end());
  Eigen::MatrixXd information = Eigen::MatrixXd::Zero(parameters.size(), parameters.size());
  const int common = parameters.common_size();
  for (std::size_t v = 0; v < tracked.views.size(); ++v) {
    ViewEvaluation at;
    ASSERT_TRUE(evaluate(v, at));
    const Eigen::MatrixXd jacobian = at.jacobian * at.local_from_blocks;
    Eigen::MatrixXd rows = Eigen::MatrixXd::Zero(jacobian.rows(), parameters.size());
    for (const Parameters::Span& span : parameters.spans(tracked.views[v]->blocks())) {
      const int offset = span.slot ? common + 6 * static_cast<int>(*span.slot) : span.common_offset;
      rows.middleCols(offset, span.size) += jacobian.middleCols(span.column, span.size);
    }
    information += rows.transpose() * rows;
  }
  const Eigen::VectorXd scale = information.diagonal().cwiseSqrt().cwiseInverse();
  const Eigen::MatrixXd scaled = scale.asDiagonal() * information * scale.asDiagonal();
  const Eigen::MatrixXd inverse =
      scale.asDiagonal() * Eigen::FullPivLU<Eigen::MatrixXd>(scaled).inverse() * scale.asDiagonal();
  const Eigen::VectorXd sigma = inverse.diagonal().cwiseSqrt().cwiseInverse();
  const Eigen::MatrixXd difference = covariance->of(blocks, state) - inverse;
  EXPECT_LT((sigma.asDiagonal() * difference * sigma.asDiagonal()).cwiseAbs().maxCoeff(), 1e-6);
}

}  // namespace
}  // namespace crumple
