#include "solvers/residuals.h"

#include <gtest/gtest.h>

#include "tests/solvers/gradients.h"
#include "tests/solvers/synthetic.h"

namespace crumple {
namespace {

CalibrationState moved_block(CalibrationState state, const BlockId& block, const Eigen::VectorXd& step) {
  switch (block.kind) {
    case BlockId::Kind::lens: {
      Lens& lens = state.rig.sensors[block.index].lens;
      std::vector<double> p = lens.parameters();
      for (std::size_t i = 0; i < p.size(); ++i) p[i] += step[static_cast<int>(i)];
      lens = lens.with_parameters(p);
      break;
    }
    case BlockId::Kind::mount:
      state.rig.sensors[block.index].sensor_from_probe =
          retract(state.rig.sensors[block.index].sensor_from_probe, step);
      break;
    case BlockId::Kind::warp:
      state.board.warp_mm += step;
      break;
    case BlockId::Kind::placement:
      state.probe_from_board[block.index] = retract(state.probe_from_board[block.index], step);
      break;
  }
  return state;
}

TEST(Residuals, VanishAtTheTruth) {
  const Synthetic made = make_synthetic({.warp_mm = {0.5, -0.3}});
  ViewEvaluation evaluation;
  for (const auto& view : make_views(made.observations)) {
    ASSERT_TRUE(view->evaluate(made.truth, false, evaluation));
    EXPECT_LT(evaluation.residuals.cwiseAbs().maxCoeff(), 1e-9) << name_of(view->kind());
  }
}

TEST(Residuals, JacobiansMatchCentralDifferences) {
  const Synthetic made = make_synthetic({.placements = 3, .warp_mm = {0.5, -0.3}});
  CalibrationState state = disturbed(made.truth, 5);
  state.board.warp_mm = {1.5, -2.0};
  for (const auto& view : make_views(made.observations)) {
    ViewEvaluation evaluation;
    ASSERT_TRUE(view->evaluate(state, true, evaluation));
    for (std::size_t b = 0; b < view->blocks().size(); ++b) {
      const BlockId block = view->blocks()[b];
      const auto residuals = [&](const Eigen::VectorXd& step) {
        ViewEvaluation at;
        EXPECT_TRUE(view->evaluate(moved_block(state, block, step), false, at));
        return at.residuals;
      };
      const Eigen::MatrixXd analytic = block_jacobian(*view, evaluation, state, b);
      const Eigen::MatrixXd numeric = central_differences(residuals, Eigen::VectorXd::Zero(analytic.cols()));
      EXPECT_LT((numeric - analytic).cwiseAbs().maxCoeff(), 2e-7 * (1 + analytic.cwiseAbs().maxCoeff()))
          << name_of(view->kind()) << " block " << b;
    }
  }
}

TEST(Residuals, ABoardBehindTheCameraIsNoPrediction) {
  Synthetic made = make_synthetic({.placements = 1});
  made.truth.probe_from_board[0].translation.z() = -800;
  ViewEvaluation evaluation;
  for (const auto& view : make_views(made.observations)) {
    EXPECT_FALSE(view->evaluate(made.truth, true, evaluation)) << name_of(view->kind());
  }
}

}  // namespace
}  // namespace crumple
