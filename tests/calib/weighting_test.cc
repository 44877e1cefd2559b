#include "calib/weighting.h"

#include <cmath>
#include <random>

#include <Eigen/LU>
#include <gtest/gtest.h>

#include "calib/uncertainty_budget.h"
#include "calib/whitened_view.h"
#include "solvers/gate.h"
#include "tests/solvers/made_system.h"
#include "tests/solvers/noisy_observations.h"
#include "tests/solvers/synthetic.h"

namespace crumple {
namespace {

Calibration refined(const CalibrationState& start, const Observations& observations, BundleOptions options = {}) {
  auto bundle = refine(start, observations, options);
  EXPECT_TRUE(bundle) << bundle.error().message;
  return {.start = start, .bundle = std::move(*bundle), .priors = options.priors};
}

// All parameters, poses too, densely, from the whole Jacobians of the groups.
struct Dense {
  Eigen::MatrixXd covariance;
  std::vector<Eigen::MatrixXd> jacobians;  // by group, whitened
};

Dense dense(const Observations& observations, const Calibration& calibration) {
  const BundleResult& bundle = calibration.bundle;
  const Parameters& parameters = bundle.covariance.parameters();
  std::vector<BlockId> blocks = parameters.common_blocks();
  blocks.insert(blocks.end(), parameters.eliminated().begin(), parameters.eliminated().end());
  Dense result{bundle.covariance.of(blocks, bundle.state), {}};
  const Eigen::Index size = result.covariance.rows();
  const auto column_of = [&](const BlockId& block) -> std::optional<Eigen::Index> {
    Eigen::Index column = 0;
    for (const BlockId& other : blocks) {
      if (other == block) return column;
      column += tangent_size(other, bundle.state);
    }
    return std::nullopt;
  };
  const auto views = make_views(observations, bundle.state.board_of);
  for (const GroupSummary& group : bundle.groups) {
    Eigen::MatrixXd jacobian(0, size);
    for (std::size_t v = 0; v < views.size(); ++v) {
      if (views[v]->sensor() != group.sensor || views[v]->kind() != group.kind) continue;
      ViewEvaluation at;
      EXPECT_TRUE(whitened_view(calibration, *views[v], v, at));
      const Eigen::MatrixXd by_blocks = at.jacobian * at.local_from_blocks;
      Eigen::MatrixXd rows = Eigen::MatrixXd::Zero(by_blocks.rows(), size);
      Eigen::Index first = 0;
      for (const BlockId& block : views[v]->blocks()) {
        const Eigen::Index width = tangent_size(block, bundle.state);
        if (const auto column = column_of(block)) rows.middleCols(*column, width) += by_blocks.middleCols(first, width);
        first += width;
      }
      jacobian.conservativeResize(jacobian.rows() + rows.rows(), Eigen::NoChange);
      jacobian.bottomRows(rows.rows()) = rows;
    }
    result.jacobians.push_back(jacobian);
  }
  return result;
}

// R = I - J C J' of all observations, and the traces of its blocks' products.
Eigen::MatrixXd information_of_sigmas(const Dense& all) {
  const auto count = static_cast<Eigen::Index>(all.jacobians.size());
  Eigen::MatrixXd f(count, count);
  for (Eigen::Index i = 0; i < count; ++i) {
    for (Eigen::Index j = 0; j < count; ++j) {
      const Eigen::MatrixXd& a = all.jacobians[static_cast<std::size_t>(i)];
      const Eigen::MatrixXd& b = all.jacobians[static_cast<std::size_t>(j)];
      Eigen::MatrixXd r = -a * all.covariance * b.transpose();
      if (i == j) r.diagonal().array() += 1;
      f(i, j) = r.squaredNorm();
    }
  }
  return f;
}

Eigen::MatrixXd widening(const Dense& all, const Eigen::MatrixXd& knowledge) {
  const Eigen::MatrixXd& c = all.covariance;
  Eigen::MatrixXd sum = Eigen::MatrixXd::Zero(c.rows(), c.cols());
  for (Eigen::Index i = 0; i < knowledge.rows(); ++i) {
    const Eigen::MatrixXd& a = all.jacobians[static_cast<std::size_t>(i)];
    sum += 4 * knowledge(i, i) * c * a.transpose() * a * c;
    for (Eigen::Index j = 0; j < knowledge.cols(); ++j) {
      const Eigen::MatrixXd& b = all.jacobians[static_cast<std::size_t>(j)];
      sum -= 4 * knowledge(i, j) * c * a.transpose() * (a * c * b.transpose()) * b * c;
    }
  }
  return sum;
}

BundleOptions of_weights_alone(int threads = 1) { return {.reject_outliers = false, .threads = threads}; }

Eigen::MatrixXd widened_by(const Observations& observations, Calibration calibration,
                           const BundleOptions& options = of_weights_alone()) {
  add_weighting(observations, options, calibration);
  return calibration.bundle.covariance.widening();
}

TEST(Weighting, IsWhatTheWholeMatricesSay) {
  const MadeSystem made = make_system({.stations = 8, .tracker_placements = 6});
  const Calibration calibration = refined(made.truth, made.observations, {.reject_outliers = false});
  const Dense all = dense(made.observations, calibration);
  const Eigen::MatrixXd expected_knowledge = information_of_sigmas(all).inverse();
  Calibration complete = calibration;
  add_weighting(made.observations, of_weights_alone(2), complete);
  const Eigen::MatrixXd& knowledge = complete.variances.half_relative_covariance;
  ASSERT_EQ(knowledge.rows(), expected_knowledge.rows());
  EXPECT_LT((knowledge - expected_knowledge).norm(), 1e-6 * expected_knowledge.norm());
  const Eigen::MatrixXd& found = complete.bundle.covariance.widening();
  const Eigen::MatrixXd expected = widening(all, expected_knowledge).topLeftCorner(found.rows(), found.cols());
  const Eigen::VectorXd sigma = calibration.bundle.covariance.common().diagonal().cwiseSqrt();
  const Eigen::MatrixXd off =
      sigma.cwiseInverse().asDiagonal() * (found - expected) * sigma.cwiseInverse().asDiagonal();
  EXPECT_LT(off.cwiseAbs().maxCoeff(), 1e-6);
  EXPECT_EQ(found, widened_by(made.observations, calibration));
  // LEDs are told by two trackers, of which either's sigma is known from a hundred readings or so.
  const Eigen::VectorXd share = found.diagonal().cwiseQuotient(sigma.cwiseAbs2());
  EXPECT_GT(share.maxCoeff(), 0.01);
  EXPECT_LT(share.maxCoeff(), 0.2);
  EXPECT_GE(share.minCoeff(), 0);
}

// Drawn anew, the estimated variances scatter as they are said to, and the two trackers' against each other.
TEST(Weighting, SigmasScatterAsTheySay) {
  constexpr MadeSystemOptions kExact{
      .projector = false, .stations = 8, .tracker_placements = 6, .led_sigma_px = 0, .corner_sigma_px = 0};
  const MadeSystem made = make_system(kExact);
  constexpr int kDraws = 150;
  std::mt19937_64 random(4);
  Eigen::Matrix2d scatter = Eigen::Matrix2d::Zero(), stated = Eigen::Matrix2d::Zero();
  for (int draw = 0; draw < kDraws; ++draw) {
    Observations noisy = made.observations;
    add_noise({.corner_px = 0.1, .led_px = 0.05}, random, noisy);
    Calibration calibration = refined(made.truth, noisy, {.reject_outliers = false});
    Eigen::Vector2d off = Eigen::Vector2d::Zero();
    Eigen::Index at[2] = {0, 0};
    add_weighting(noisy, of_weights_alone(), calibration);
    for (std::size_t g = 0, k = 0; g < calibration.bundle.groups.size(); ++g) {
      const GroupSummary& group = calibration.bundle.groups[g];
      if (group.kind != View::Kind::leds) continue;
      off[static_cast<Eigen::Index>(k)] = std::pow(group.sigma_px / 0.05, 2) - 1;
      at[k++] = static_cast<Eigen::Index>(calibration.variances.of_group[g].value());
    }
    scatter += off * off.transpose() / kDraws;
    for (Eigen::Index i = 0; i < 2; ++i) {
      for (Eigen::Index j = 0; j < 2; ++j)
        stated(i, j) += 2 * calibration.variances.half_relative_covariance(at[i], at[j]) / kDraws;
    }
  }
  EXPECT_LT(stated(0, 1), -0.05 * stated(0, 0));
  const double error = std::sqrt(2.0 / kDraws);
  EXPECT_NEAR(scatter(0, 0) / stated(0, 0), 1, 4 * error);
  EXPECT_NEAR(scatter(1, 1) / stated(1, 1), 1, 4 * error);
  EXPECT_NEAR(scatter(0, 1) / std::sqrt(stated(0, 0) * stated(1, 1)),
              stated(0, 1) / std::sqrt(stated(0, 0) * stated(1, 1)), 4 * error);
}

// What one group tells does not hang on its weight.
TEST(Weighting, OfOneGroupIsNothing) {
  const Synthetic made = make_synthetic({.placements = 6, .corner_sigma_px = 0.1});
  CalibrationState camera = made.truth;
  camera.rig.sensors.pop_back();
  Observations corners{made.observations.placement_count, made.observations.corners, {}, {}};
  const Calibration calibration = refined(camera, corners);
  const Eigen::VectorXd variance = calibration.bundle.covariance.common().diagonal();
  const Eigen::MatrixXd found = widened_by(corners, calibration);
  EXPECT_LT(found.diagonal().cwiseQuotient(variance).maxCoeff(), 1e-9);
}

// The gate costs all that one group tells the same share, by the mean redundancy of an observation.
TEST(Weighting, TheGateCostsWhatItLeavesOutByChance) {
  const Synthetic made = make_synthetic({.placements = 6, .corner_sigma_px = 0.1});
  CalibrationState camera = made.truth;
  camera.rig.sensors.pop_back();
  Observations corners{made.observations.placement_count, made.observations.corners, {}, {}};
  const Calibration calibration = refined(camera, corners);
  const GroupSummary& group = calibration.bundle.groups[0];
  const double coordinates = 2.0 * static_cast<double>(group.observations - group.outliers);
  const Eigen::VectorXd variance = calibration.bundle.covariance.common().diagonal();
  const Eigen::VectorXd share = widened_by(corners, calibration, {}).diagonal().cwiseQuotient(variance);
  const double expected = cost_of_gate(2, 16) * coordinates / group.redundancy;
  EXPECT_NEAR(share.minCoeff(), expected, 1e-6);
  EXPECT_NEAR(share.maxCoeff(), expected, 1e-6);
}

// Beside a prior that is exact: with s the share of the observations, 4 / nu s (1 - s) of a single parameter's
// variance.
TEST(Weighting, BesideAPriorOfOneParameter) {
  const Synthetic made = make_synthetic({.placements = 6, .corner_sigma_px = 0.1});
  CalibrationState camera = made.truth;
  camera.rig.sensors.pop_back();
  Observations corners{made.observations.placement_count, made.observations.corners, {}, {}};
  const double alone = refined(camera, corners).bundle.covariance.common()(0, 0);
  BundleOptions options;
  for (int row = 0; row < camera.rig.sensors[0].lens.parameter_count(); ++row) {
    const double variance = row == 0 ? alone : 1e-24;
    options.priors.push_back(
        Prior::create("lens", {{{BlockId::Kind::lens, 0}, row}}, camera, Eigen::MatrixXd::Constant(1, 1, variance))
            .value());
  }
  const Calibration calibration = refined(camera, corners, options);
  const double variance = calibration.bundle.covariance.common()(0, 0);
  const double share = 1 - variance / alone;
  Calibration complete = calibration;
  add_weighting(corners, of_weights_alone(), complete);
  const double degrees = budget_sources(complete)[0].sigma_degrees_of_freedom;
  const Eigen::MatrixXd found = widened_by(corners, calibration);
  EXPECT_GT(share, 0.5);
  EXPECT_LT(share, 0.99);
  EXPECT_NEAR(found(0, 0) / variance * degrees, 4 * share * (1 - share), 1e-4);
}

}  // namespace
}  // namespace crumple
