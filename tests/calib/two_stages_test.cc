// Cameras first, then the rest with what they were found to be as a prior: the same answer, and the same covariance, as
// all at once. What one stage sees the other does not: a placement or station that both saw would tie them by more
// than the rig.
#include <algorithm>
#include <cmath>
#include <set>

#include <gtest/gtest.h>

#include "calib/rig_prior.h"
#include "solvers/bundle.h"
#include "tests/solvers/joint_solve.h"
#include "tests/solvers/made_system.h"

namespace crumple {
namespace {

// Two placements of the probe's board, which the stations take turns at: before the first one the trackers' and the
// camera's views alone, before the second one everything.
struct Stages {
  MadeSystem made;
  Observations first, second, together;
};

Stages stages(int stations, double noise, unsigned seed) {
  Stages result{make_system({.stations = stations,
                             .placements = 2,
                             .tracker_placements = stations / 2,
                             .led_sigma_px = 0.05 * noise,
                             .corner_sigma_px = 0.1 * noise,
                             .stripe_sigma_px = 0.1 * noise,
                             .seed = seed}),
                {},
                {},
                {}};
  const Observations& all = result.made.observations;
  for (Observations* part : {&result.first, &result.second, &result.together}) {
    part->placement_count = all.placement_count;
  }
  const auto is_second = [](std::optional<std::size_t> station) { return station && *station % 2 == 1; };
  for (const CornerView& view : all.corners) {
    (is_second(view.station) ? result.second : result.first).corners.push_back(view);
  }
  for (const LedView& view : all.leds) {
    (is_second(view.station) ? result.second : result.first).leds.push_back(view);
  }
  for (const StripeView& view : all.stripes) {
    if (is_second(view.station)) result.second.stripes.push_back(view);
  }
  result.together.corners = all.corners;
  result.together.leds = all.leds;
  result.together.stripes = result.second.stripes;
  return result;
}

// As a rig of cameras is on disk: it has no projector.
Rig rig_of_cameras(const CalibrationState& state, const JointCovariance& covariance) {
  Rig rig = state.rig;
  const int rows = covariance.rig_rows();
  rig.covariance = {{covariance.names().begin(), covariance.names().begin() + rows},
                    covariance.common().topLeftCorner(rows, rows)};
  std::erase_if(rig.sensors, [](const Sensor& sensor) { return sensor.kind == SensorKind::projector; });
  return rig;
}

// Differences between the two ways in units of sigmas: of the rig's parameters, and the largest of their covariance.
struct Differences {
  Eigen::VectorXd answer;
  double covariance = 0;
};

Differences differences(const CalibrationState& together, const JointCovariance& of_together,
                        const CalibrationState& second, const JointCovariance& of_second,
                        const Parameters& parameters) {
  const int rows = of_together.rig_rows();
  EXPECT_TRUE(std::equal(of_together.names().begin(), of_together.names().begin() + rows, of_second.names().begin()));
  const Eigen::VectorXd sigmas = of_together.common().diagonal().head(rows).cwiseSqrt();
  const Eigen::MatrixXd difference =
      of_second.common().topLeftCorner(rows, rows) - of_together.common().topLeftCorner(rows, rows);
  Differences result{Eigen::VectorXd(rows),
                     difference.cwiseQuotient(sigmas * sigmas.transpose()).cwiseAbs().maxCoeff()};
  Eigen::Index row = 0;
  for (const BlockId& block : parameters.common_blocks()) {
    if (block.is_pose()) continue;
    for (const double step : block_step(block, together, second)) {
      result.answer[row] = step / sigmas[row];
      ++row;
    }
  }
  EXPECT_EQ(row, rows);
  return result;
}

// Each kind's noise is known: what a stage estimates of it from its own share of the observations is another number.
BundleOptions known_noise(double noise) {
  BundleOptions options{.reject_outliers = false, .estimate_known_sigmas = false};
  for (const char* group : {"cam0.corners", "track0.corners", "track1.corners", "proj0.stripes"}) {
    options.known_sigma_px[group] = 0.1 * noise;
  }
  for (const char* group : {"track0.leds", "track1.leds"}) options.known_sigma_px[group] = 0.05 * noise;
  return options;
}

// Of the gauge, and what is not estimated here.
std::set<BlockId> held_blocks() {
  using Kind = BlockId::Kind;
  return {{Kind::mount, 0}, {Kind::mount, 2}, {Kind::warp, 0}, {Kind::warp, 1}, {Kind::scale, 0}, {Kind::scale, 1}};
}

// One step of least squares from the truth: linear in the observations.
struct LinearFit {
  Parameters parameters;
  CalibrationState state;
  JointCovariance covariance;
};

LinearFit linear_fit(const Observations& observations, const CalibrationState& truth, const BundleOptions& noise) {
  const auto views = make_views(observations, truth.board_of);
  std::vector<ViewWeights> weights;
  for (const auto& view : views) {
    weights.push_back({noise.known_sigma_px.at(group_name(truth.rig, view->sensor(), view->kind())), 1,
                       std::vector<char>(static_cast<std::size_t>(view->size()), 1)});
  }
  Parameters parameters(truth, views, held_blocks());
  const auto equations = joint_equations({views, weights, noise.priors}, parameters, truth);
  const Eigen::VectorXd step = equations->solve(0, 1)->tangent;
  JointCovariance covariance = JointCovariance::create(*equations, truth).value();
  CalibrationState state = moved(truth, parameters, step);
  return {std::move(parameters), std::move(state), std::move(covariance)};
}

TEST(TwoStages, AreOneWhereTheModelIsLinear) {
  constexpr double kNoise = 1e-5;
  const Stages data = stages(10, kNoise, 5);
  BundleOptions noise = known_noise(kNoise);
  const LinearFit together = linear_fit(data.together, data.made.truth, noise);
  const LinearFit first = linear_fit(data.first, data.made.truth, noise);
  const auto known = rig_prior(rig_of_cameras(first.state, first.covariance), data.made.truth, data.second);
  ASSERT_TRUE(known) << known.error().message;
  noise.priors = {known->prior};
  const LinearFit second = linear_fit(data.second, data.made.truth, noise);
  const Differences found =
      differences(together.state, together.covariance, second.state, second.covariance, second.parameters);
  EXPECT_LT(found.answer.cwiseAbs().maxCoeff(), 1e-6);
  EXPECT_LT(found.covariance, 1e-6);
}

// The prior, a parabola, is not quite all that the first stage's observations say: it differs the more, the less they
// know. With half the stations, or twice the noise, one campaign in ten is beyond.
TEST(TwoStages, AgreeWithinTwoPercentWithNoise) {
  constexpr double kNoise = 0.5;  // corners and stripes of 0.05 px, LEDs of 0.025 px
  for (unsigned seed = 1; seed <= 8; ++seed) {
    SCOPED_TRACE(seed);
    const Stages data = stages(48, kNoise, seed);
    BundleOptions options = known_noise(kNoise);
    const auto together = refine(data.made.truth, data.together, options);
    ASSERT_TRUE(together) << together.error().message;
    const auto first = refine(data.made.truth, data.first, options);
    ASSERT_TRUE(first) << first.error().message;
    const auto known = rig_prior(rig_of_cameras(first->state, first->covariance), data.made.truth, data.second);
    ASSERT_TRUE(known) << known.error().message;
    options.held = known->held;
    options.priors = {known->prior};
    const auto second = refine(known->state, data.second, options);
    ASSERT_TRUE(second) << second.error().message;
    const auto views = make_views(data.second, data.made.truth.board_of);
    const Parameters parameters(data.made.truth, views, held_blocks());
    const Differences found =
        differences(together->state, together->covariance, second->state, second->covariance, parameters);
    EXPECT_LT(found.answer.norm() / std::sqrt(static_cast<double>(found.answer.size())), 0.02);
    EXPECT_LT(found.covariance, 0.02);
  }
}

}  // namespace
}  // namespace crumple
