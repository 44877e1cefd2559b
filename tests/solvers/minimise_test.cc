#include "solvers/minimise.h"

#include <ceres/ceres.h>
#include <gtest/gtest.h>

#include "solvers/covariance.h"
#include "tests/solvers/synthetic.h"

namespace crumple {
namespace {

using Views = std::vector<std::unique_ptr<View>>;

std::vector<ViewWeights> unit_weights(const Views& views) {
  std::vector<ViewWeights> weights;
  for (const auto& view : views)
    weights.push_back({1, 1, std::vector<char>(static_cast<std::size_t>(view->size()), 1)});
  return weights;
}

// The oracle is Ceres on one dense block that holds everything estimated. A pose stands there as rotation vector and
// translation, which is the step that leads to it from the identity.
class Whole {
 public:
  Whole(const Views& all_views, const Parameters& estimated, const CalibrationState& start)
      : views(all_views), parameters(estimated), origin_(start), x(static_cast<std::size_t>(estimated.size())) {
    auto value = x.begin();
    const auto take = [&](Pose& pose) {
      const Vector6d step = local_step({}, pose);
      value = std::copy(step.begin(), step.end(), value);
      pose = {};
    };
    for (const BlockId& block : parameters.common_blocks()) {
      Sensor* const sensor = block.kind == BlockId::Kind::warp ? nullptr : &origin_.rig.sensors[block.index];
      if (block.kind == BlockId::Kind::lens) {
        const std::vector<double> lens = sensor->lens.parameters();
        value = std::copy(lens.begin(), lens.end(), value);
        sensor->lens = sensor->lens.with_parameters(std::vector<double>(lens.size(), 0.0));
      } else if (block.kind == BlockId::Kind::mount) {
        take(sensor->sensor_from_probe);
      } else {
        value = std::copy(origin_.board.warp_mm.begin(), origin_.board.warp_mm.end(), value);
        origin_.board.warp_mm.setZero();
      }
    }
    for (const std::size_t p : parameters.placements()) take(origin_.probe_from_board[p]);
  }

  CalibrationState state_at(const double* at) const {
    return moved(origin_, parameters, Eigen::Map<const Eigen::VectorXd>(at, parameters.size()));
  }

  const Views& views;
  const Parameters& parameters;

 private:
  CalibrationState origin_;

 public:
  std::vector<double> x;
};

// Jacobians come in tangents already, so the derivative of Plus is declared to be the identity.
class TangentManifold final : public ceres::Manifold {
 public:
  explicit TangentManifold(const Whole& whole) : whole_(whole) {}
  int AmbientSize() const override { return whole_.parameters.size(); }
  int TangentSize() const override { return whole_.parameters.size(); }
  bool Plus(const double* x, const double* delta, double* sum) const override {
    const CalibrationState there =
        moved(whole_.state_at(x), whole_.parameters, Eigen::Map<const Eigen::VectorXd>(delta, AmbientSize()));
    const Whole read(whole_.views, whole_.parameters, there);
    std::copy(read.x.begin(), read.x.end(), sum);
    return true;
  }
  bool PlusJacobian(const double*, double* jacobian) const override {
    Eigen::Map<Eigen::MatrixXd>(jacobian, AmbientSize(), AmbientSize()).setIdentity();
    return true;
  }
  bool Minus(const double*, const double*, double*) const override { return false; }
  bool MinusJacobian(const double*, double*) const override { return false; }

 private:
  const Whole& whole_;
};

class WholeCost final : public ceres::CostFunction {
 public:
  explicit WholeCost(const Whole& whole) : whole_(whole) {
    int rows = 0;
    for (const auto& view : whole.views) rows += view->size() * view->dimension();
    set_num_residuals(rows);
    mutable_parameter_block_sizes()->push_back(whole.parameters.size());
  }

  bool Evaluate(const double* const* x, double* residuals, double** jacobians) const override {
    const CalibrationState state = whole_.state_at(x[0]);
    const int columns = whole_.parameters.size();
    RowMajorMatrix jacobian = RowMajorMatrix::Zero(num_residuals(), columns);
    Eigen::Map<Eigen::VectorXd> all(residuals, num_residuals());
    int row = 0;
    for (const auto& view : whole_.views) {
      ViewEvaluation evaluation;
      if (!view->evaluate(state, true, evaluation)) return false;
      const int rows = static_cast<int>(evaluation.residuals.size());
      all.segment(row, rows) = evaluation.residuals;
      const Eigen::MatrixXd by_blocks = evaluation.jacobian * evaluation.local_from_blocks;
      for (const Parameters::Span& span : whole_.parameters.spans(view->blocks())) {
        const int at = span.placement ? whole_.parameters.common_size() + 6 * static_cast<int>(*span.placement)
                                      : span.common_offset;
        jacobian.block(row, at, rows, span.size) = by_blocks.middleCols(span.column, span.size);
      }
      row += rows;
    }
    if (jacobians != nullptr && jacobians[0] != nullptr) {
      Eigen::Map<RowMajorMatrix>(jacobians[0], num_residuals(), columns) = jacobian;
    }
    return true;
  }

 private:
  const Whole& whole_;
};

double cost_by_ceres(Whole& whole) {
  ceres::Problem problem;
  problem.AddResidualBlock(new WholeCost(whole), nullptr, whole.x.data());
  problem.SetManifold(whole.x.data(), new TangentManifold(whole));
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::DENSE_NORMAL_CHOLESKY;
  options.function_tolerance = options.gradient_tolerance = options.parameter_tolerance = 1e-15;
  options.max_num_iterations = 100;
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  return summary.final_cost;
}

TEST(Minimise, ReachesTheOptimumThatCeresReaches) {
  const Synthetic made = make_synthetic({.placements = 5,
                                         .corner_sigma_px = 0.2,
                                         .stripe_sigma_px = 0.1,
                                         .feature_sigma_px = 0.3,
                                         .warp_mm = {0.6, -0.4}});
  const auto views = make_views(made.observations);
  CalibrationState state = disturbed(made.truth, 3);
  const Parameters parameters(state, views, {{BlockId::Kind::mount, 0}});
  Whole whole(views, parameters, state);
  const auto minimum = minimise(views, unit_weights(views), parameters, {}, state);
  ASSERT_TRUE(minimum) << minimum.error().message;
  EXPECT_TRUE(minimum->converged);
  EXPECT_LE(minimum->iterations, 12);
  const double expected = cost_by_ceres(whole);
  EXPECT_NEAR(minimum->final_cost, expected, 1e-9 * expected);
  // In standard deviations: the last digits of terms that the observations hardly tell apart mean nothing.
  const auto covariance = JointCovariance::create(minimum->equations, state);
  ASSERT_TRUE(covariance) << covariance.error().message;
  const CalibrationState oracle = whole.state_at(whole.x.data());
  for (std::size_t s = 0; s < 2; ++s) {
    const std::vector<double>& found = state.rig.sensors[s].lens.parameters();
    const int row = *parameters.common_offset({BlockId::Kind::lens, s});
    for (std::size_t i = 0; i < found.size(); ++i) {
      const int k = row + static_cast<int>(i);
      const double sigma = std::sqrt(covariance->common()(k, k));
      EXPECT_NEAR(found[i], oracle.rig.sensors[s].lens.parameters()[i], 1e-5 * sigma) << covariance->names()[k];
    }
  }
}

TEST(Minimise, AStartThatPredictsNothingIsAnErrorAndIsLeftAlone) {
  const Synthetic made = make_synthetic({.placements = 3});
  const auto views = make_views(made.observations);
  CalibrationState state = made.truth;
  state.probe_from_board[1].translation.z() = -800;
  const Parameters parameters(state, views, {{BlockId::Kind::mount, 0}});
  EXPECT_FALSE(minimise(views, unit_weights(views), parameters, {}, state));
  EXPECT_EQ(state.probe_from_board[1].translation.z(), -800);
}

}  // namespace
}  // namespace crumple
