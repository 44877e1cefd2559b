#include "calib/weighting.h"

#include <cmath>
#include <map>

#include <Eigen/Eigenvalues>
#include <gtest/gtest.h>

#include "calib/uncertainty_budget.h"
#include "calib/whitened_view.h"
#include "tests/solvers/made_system.h"
#include "tests/solvers/synthetic.h"

namespace crumple {
namespace {

Calibration refined(const CalibrationState& start, const Observations& observations, BundleOptions options = {}) {
  auto bundle = refine(start, observations, options);
  EXPECT_TRUE(bundle) << bundle.error().message;
  return {.start = start, .bundle = std::move(*bundle), .priors = options.priors};
}

// Of all parameters, poses too, densely: by the groups that `chosen` names, 1 / nu of each beside its information.
Eigen::MatrixXd dense(const Observations& observations, const Calibration& calibration) {
  const BundleResult& bundle = calibration.bundle;
  const Parameters& parameters = bundle.covariance.parameters();
  std::vector<BlockId> blocks = parameters.common_blocks();
  blocks.insert(blocks.end(), parameters.eliminated().begin(), parameters.eliminated().end());
  const Eigen::MatrixXd c = bundle.covariance.of(blocks, bundle.state);
  const auto column_of = [&](const BlockId& block) -> std::optional<Eigen::Index> {
    Eigen::Index column = 0;
    for (const BlockId& other : blocks) {
      if (other == block) return column;
      column += tangent_size(other, bundle.state);
    }
    return std::nullopt;
  };
  const auto views = make_views(observations, bundle.state.board_of);
  const auto sources = budget_sources(calibration);
  Eigen::MatrixXd sum = Eigen::MatrixXd::Zero(c.rows(), c.cols());
  for (std::size_t g = 0; g < bundle.groups.size(); ++g) {
    Eigen::MatrixXd information = Eigen::MatrixXd::Zero(c.rows(), c.cols());
    for (std::size_t v = 0; v < views.size(); ++v) {
      if (views[v]->sensor() != bundle.groups[g].sensor || views[v]->kind() != bundle.groups[g].kind) continue;
      ViewEvaluation at;
      EXPECT_TRUE(whitened_view(calibration, *views[v], v, at));
      const Eigen::MatrixXd by_blocks = at.jacobian * at.local_from_blocks;
      Eigen::MatrixXd rows = Eigen::MatrixXd::Zero(by_blocks.rows(), c.cols());
      Eigen::Index first = 0;
      for (const BlockId& block : views[v]->blocks()) {
        const Eigen::Index size = tangent_size(block, bundle.state);
        if (const auto column = column_of(block)) rows.middleCols(*column, size) += by_blocks.middleCols(first, size);
        first += size;
      }
      information += rows.transpose() * rows;
    }
    sum += 4 / sources[g].sigma_degrees_of_freedom * c * (information - information * c * information) * c;
  }
  return sum.topLeftCorner(parameters.common_size(), parameters.common_size());
}

TEST(Weighting, IsWhatTheWholeMatricesSay) {
  const MadeSystem made = make_system({.stations = 8, .tracker_placements = 6});
  const Calibration calibration = refined(made.truth, made.observations);
  const Eigen::MatrixXd expected = dense(made.observations, calibration);
  const Eigen::MatrixXd found = weighting_covariance(made.observations, calibration, 2);
  const Eigen::VectorXd sigma = calibration.bundle.covariance.common().diagonal().cwiseSqrt();
  const Eigen::MatrixXd off =
      sigma.cwiseInverse().asDiagonal() * (found - expected) * sigma.cwiseInverse().asDiagonal();
  EXPECT_LT(off.cwiseAbs().maxCoeff(), 1e-8);
  EXPECT_EQ(found, weighting_covariance(made.observations, calibration, 1));
  // LEDs are told by two trackers, of which either's sigma is known from a hundred readings or so.
  const Eigen::VectorXd share = found.diagonal().cwiseQuotient(sigma.cwiseAbs2());
  EXPECT_GT(share.maxCoeff(), 0.01);
  EXPECT_LT(share.maxCoeff(), 0.1);
  EXPECT_GE(share.minCoeff(), 0);
}

// What one group tells does not hang on its weight.
TEST(Weighting, OfOneGroupIsNothing) {
  const Synthetic made = make_synthetic({.placements = 6, .corner_sigma_px = 0.1});
  CalibrationState camera = made.truth;
  camera.rig.sensors.pop_back();
  Observations corners{made.observations.placement_count, made.observations.corners, {}, {}};
  const Calibration calibration = refined(camera, corners);
  const Eigen::VectorXd variance = calibration.bundle.covariance.common().diagonal();
  const Eigen::MatrixXd found = weighting_covariance(corners, calibration, 1);
  EXPECT_LT(found.diagonal().cwiseQuotient(variance).maxCoeff(), 1e-9);
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
  const double degrees = budget_sources(calibration)[0].sigma_degrees_of_freedom;
  const Eigen::MatrixXd found = weighting_covariance(corners, calibration, 1);
  EXPECT_GT(share, 0.5);
  EXPECT_LT(share, 0.99);
  EXPECT_NEAR(found(0, 0) / variance * degrees, 4 * share * (1 - share), 1e-4);
}

}  // namespace
}  // namespace crumple
