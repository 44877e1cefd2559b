#include "solvers/residuals.h"

#include <gtest/gtest.h>

#include "solvers/parameters.h"
#include "tests/solvers/gradients.h"
#include "tests/solvers/synthetic.h"

namespace crumple {
namespace {

CalibrationState moved_block(CalibrationState state, const BlockId& block, const Eigen::VectorXd& step) {
  move_block(block, step, state);
  return state;
}

TEST(Residuals, VanishAtTheTruth) {
  const Synthetic made = make_synthetic({.warp_mm = {0.5, -0.3}});
  ViewEvaluation evaluation;
  for (const auto& view : make_views(made.observations, made.truth.board_of)) {
    ASSERT_TRUE(view->evaluate(made.truth, false, evaluation));
    EXPECT_LT(evaluation.residuals.cwiseAbs().maxCoeff(), 1e-9) << name_of(view->kind());
  }
}

class Jacobians : public testing::TestWithParam<double> {};  // the radius of the board's discs; 0: corners

TEST_P(Jacobians, MatchCentralDifferences) {
  const Synthetic made = make_synthetic({.placements = 3, .warp_mm = {0.5, -0.3}, .disc_radius_mm = GetParam()});
  CalibrationState state = disturbed(made.truth, 5);
  state.boards[0].warp_mm = {1.5, -2.0};
  state.boards[0].scale = 0.997;
  for (const auto& view : make_views(made.observations, made.truth.board_of)) {
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

INSTANTIATE_TEST_SUITE_P(CornersAndDiscs, Jacobians, testing::Values(0, 9));

TEST(Residuals, ABoardBehindTheCameraIsNoPrediction) {
  Synthetic made = make_synthetic({.placements = 1});
  made.truth.world_from_board[0].translation.z() = -800;
  ViewEvaluation evaluation;
  for (const auto& view : make_views(made.observations, made.truth.board_of)) {
    EXPECT_FALSE(view->evaluate(made.truth, true, evaluation)) << name_of(view->kind());
  }
}

}  // namespace
}  // namespace crumple
