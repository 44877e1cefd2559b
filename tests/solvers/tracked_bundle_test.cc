// The joint refinement of trackers, LEDs, probe and boards.
#include <algorithm>
#include <cmath>
#include <functional>
#include <utility>

#include <Eigen/Cholesky>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "solvers/bundle.h"
#include "tests/solvers/gradients.h"
#include "tests/solvers/made_system.h"

namespace crumple {
namespace {

constexpr MadeSystemOptions kExact{.led_sigma_px = 0, .corner_sigma_px = 0, .stripe_sigma_px = 0};

TEST(TrackedResiduals, VanishAtTheTruth) {
  const MadeSystem made = make_system(kExact);
  for (const auto& view : make_views(made.observations, made.truth.board_of)) {
    ViewEvaluation evaluation;
    ASSERT_TRUE(view->evaluate(made.truth, false, evaluation));
    EXPECT_LT(evaluation.residuals.cwiseAbs().maxCoeff(), 1e-9) << name_of(view->kind()) << " at " << place_of(*view);
  }
}

TEST(TrackedResiduals, JacobiansMatchCentralDifferences) {
  const MadeSystem made = make_system({.stations = 3, .placements = 2, .tracker_placements = 2});
  const CalibrationState state = disturbed_system(made.truth, 3);
  for (const auto& view : make_views(made.observations, made.truth.board_of)) {
    ViewEvaluation evaluation;
    ASSERT_TRUE(view->evaluate(state, true, evaluation));
    for (std::size_t b = 0; b < view->blocks().size(); ++b) {
      const auto residuals = [&](const Eigen::VectorXd& step) {
        CalibrationState there = state;
        move_block(view->blocks()[b], step, there);
        ViewEvaluation at;
        EXPECT_TRUE(view->evaluate(there, false, at));
        return at.residuals;
      };
      const Eigen::MatrixXd analytic = block_jacobian(*view, evaluation, state, b);
      const Eigen::MatrixXd numeric = central_differences(residuals, Eigen::VectorXd::Zero(analytic.cols()));
      EXPECT_LT((numeric - analytic).cwiseAbs().maxCoeff(), 2e-7 * (1 + analytic.cwiseAbs().maxCoeff()))
          << name_of(view->kind()) << " at " << place_of(*view) << ", block " << b;
    }
  }
}

void expect_near(const CalibrationState& found, const CalibrationState& truth, double angle_rad, double length_mm) {
  for (std::size_t s = 0; s < truth.rig.sensors.size(); ++s) {
    const Vector6d step = local_step(truth.rig.sensors[s].sensor_from_mount, found.rig.sensors[s].sensor_from_mount);
    EXPECT_LT(step.head<3>().norm(), angle_rad) << truth.rig.sensors[s].name;
    EXPECT_LT(step.tail<3>().norm(), length_mm) << truth.rig.sensors[s].name;
  }
  for (std::size_t l = 0; l < truth.rig.leds.size(); ++l) {
    EXPECT_LT((found.rig.leds[l].position_mm - truth.rig.leds[l].position_mm).norm(), length_mm) << l;
  }
  for (std::size_t s = 0; s < truth.world_from_probe.size(); ++s) {
    const Vector6d step = local_step(truth.world_from_probe[s], found.world_from_probe[s]);
    EXPECT_LT(step.head<3>().norm(), angle_rad) << "station " << s;
    EXPECT_LT(step.tail<3>().norm(), length_mm) << "station " << s;
  }
}

struct Parts {
  const char* name;
  MadeSystemOptions options;
};

class TrackedBundle : public testing::TestWithParam<Parts> {};

TEST_P(TrackedBundle, RecoversNoiseFreeTruth) {
  MadeSystemOptions options = GetParam().options;
  options.led_sigma_px = options.corner_sigma_px = options.stripe_sigma_px = 0;
  const MadeSystem made = make_system(options);
  const auto result = refine(disturbed_system(made.truth, 5), made.observations, {});
  ASSERT_TRUE(result) << result.error().message;
  expect_near(result->state, made.truth, 1e-7, 1e-4);
}

INSTANTIATE_TEST_SUITE_P(
    AnyPart, TrackedBundle,
    testing::Values(Parts{"Whole", {}}, Parts{"ManyPlacements", {.stations = 24, .placements = 12}},
                    Parts{"OneTracker", {.trackers = 1, .stations = 15}},
                    Parts{"FourTrackersAndAWand", {.trackers = 4, .leds = 8, .stations = 12, .wand_stations = 20}},
                    Parts{"TwoCamerasAndTwoProjectors", {.second_pair = true, .stations = 16}},
                    Parts{"NoProjector", {.projector = false}}, Parts{"RoomReferences", {.room_leds = 6}},
                    Parts{"MovedTrackers", {.room_leds = 6, .moved_trackers = true}}),
    [](const auto& of_case) { return of_case.param.name; });

// A board that is somewhere else at every station, and that no tracker sees, ties the LEDs to no camera.
TEST(TrackedBundleNoise, WhatNothingTiesIsRefusedByName) {
  const MadeSystem made = make_system({.stations = 12, .placements = 12});
  const auto result = refine(disturbed_system(made.truth, 5), made.observations, {});
  ASSERT_FALSE(result);
  EXPECT_NE(result.error().message.find("determine"), std::string::npos) << result.error().message;
}

TEST(TrackedBundleNoise, EveryGroupsSigmaIsFound) {
  const MadeSystem made =
      make_system({.stations = 25, .led_sigma_px = 0.05, .corner_sigma_px = 0.1, .stripe_sigma_px = 0.2});
  const auto result = refine(disturbed_system(made.truth, 5), made.observations, {});
  ASSERT_TRUE(result) << result.error().message;
  for (const GroupSummary& group : result->groups) {
    const double truth_px = group.kind == View::Kind::leds ? 0.05 : group.kind == View::Kind::stripes ? 0.2 : 0.1;
    EXPECT_TRUE(group.sigma_estimated);
    EXPECT_NEAR(group.sigma_px, truth_px, 4 * truth_px / std::sqrt(2 * group.redundancy))
        << group_name(made.truth.rig, group.sensor, group.kind);
  }
}

TEST(TrackedBundleNoise, TheSameBitsAtAnyThreadCount) {
  const MadeSystem made = make_system({.stations = 9, .placements = 2, .tracker_placements = 8});
  const CalibrationState start = disturbed_system(made.truth, 5);
  const auto one = refine(start, made.observations, {.threads = 1});
  const auto three = refine(start, made.observations, {.threads = 3});
  ASSERT_TRUE(one && three);
  EXPECT_EQ(one->covariance.common(), three->covariance.common());
  for (std::size_t l = 0; l < made.truth.rig.leds.size(); ++l) {
    EXPECT_EQ(one->state.rig.leds[l].position_mm, three->state.rig.leds[l].position_mm);
  }
}

// The placings of one bar share the certificate's error.
Prior scale_bar(const MadeSystem& made, double length_mm, double certificate_mm, double placing_mm) {
  std::vector<LedDistance> places;
  for (std::size_t l = 0; l < made.truth.rig.leds.size(); ++l) {
    if (made.truth.rig.leds[l].name.ends_with("a")) places.push_back({l, l + 1, length_mm});
  }
  const auto count = static_cast<Eigen::Index>(places.size());
  Eigen::MatrixXd covariance = Eigen::MatrixXd::Constant(count, count, certificate_mm * certificate_mm);
  covariance.diagonal().array() += placing_mm * placing_mm;
  return Prior::of_distances("bar", std::move(places), covariance).value();
}

TEST(ScaleBar, JacobianMatchesCentralDifferences) {
  const MadeSystem made = make_system({.stations = 2, .bar_mm = 900, .bar_places = 3});
  const Prior bar = scale_bar(made, 899, 0.02, 0.01);
  ASSERT_EQ(bar.blocks().size(), 6u);
  const WhitenedPrior at = bar.evaluate(made.truth);
  for (std::size_t b = 0; b < bar.blocks().size(); ++b) {
    const auto residuals = [&](const Eigen::VectorXd& step) {
      CalibrationState there = made.truth;
      move_block(bar.blocks()[b], step, there);
      return bar.evaluate(there).residuals;
    };
    const Eigen::MatrixXd numeric = central_differences(residuals, Eigen::VectorXd::Zero(3));
    EXPECT_LT((numeric - at.jacobians[b]).cwiseAbs().maxCoeff(), 1e-6 * at.jacobians[b].cwiseAbs().maxCoeff()) << b;
  }
}

TEST(ScaleBar, RefusesOneLedTwice) {
  EXPECT_FALSE(Prior::of_distances("bar", {{1, 1, 100}}, Eigen::MatrixXd::Ones(1, 1)));
  EXPECT_FALSE(Prior::of_distances("bar", {{1, 2, 100}, {3, 4, 100}}, Eigen::MatrixXd::Ones(2, 2)));
}

// Boards of which nothing is known beforehand: with their scale a parameter, the bar tells the size of everything, and
// no better than its certificate however often it is put down.
TEST(ScaleBar, TellsTheScaleThatBoardsDoNotKnow) {
  const MadeSystem made = make_system({.stations = 16, .bar_mm = 1100, .bar_places = 4});
  CalibrationState start = made.truth;
  std::vector<PriorTerm> scales;
  for (std::size_t b = 0; b < start.boards.size(); ++b) {
    start.boards[b].scale = 0.996;
    scales.push_back({{BlockId::Kind::scale, b}, 0});
  }
  const Prior weak = Prior::create("scale.weak", scales, start, 0.0025 * Eigen::Matrix2d::Identity()).value().as_weak();
  std::vector<Eigen::Vector2d> variances;
  for (const double relative : {1e-4, 1e-3}) {
    const auto result =
        refine(start, made.observations, {.priors = {scale_bar(made, 1100, 1100 * relative, 1e-3), weak}});
    ASSERT_TRUE(result) << result.error().message;
    EXPECT_TRUE(result->undetermined.empty());
    variances.emplace_back();
    for (std::size_t b = 0; b < start.boards.size(); ++b) {
      const double variance = result->covariance.of({{BlockId::Kind::scale, b}}, result->state)(0, 0);
      EXPECT_LT(std::abs(result->state.boards[b].scale - 1), 3 * std::sqrt(variance));
      variances.back()[static_cast<Eigen::Index>(b)] = variance;
    }
  }
  // What the larger certificate adds to both boards alike.
  const Eigen::Vector2d added = variances[1] - variances[0];
  EXPECT_NEAR(added[0], 1e-6 - 1e-8, 2e-8);
  EXPECT_NEAR(added[1], 1e-6 - 1e-8, 2e-8);
}

// Two readings of the end of a bar that contradict each other, and which of these the refinement accepted.
std::vector<char> accepted_of_contradicting(const std::function<Prior(const MadeSystem&, std::size_t)>& prior_of) {
  MadeSystem made = make_system({.stations = 16, .bar_mm = 1100, .bar_places = 2});
  const auto& leds = made.truth.rig.leds;
  const auto end = std::find_if(leds.begin(), leds.end(), [](const Led& led) { return led.name == "bar1a"; });
  const auto number = static_cast<std::size_t>(end - leds.begin());
  std::vector<std::pair<std::size_t, std::size_t>> readings;  // view, and observation in it
  for (std::size_t v = 0; v < made.observations.leds.size(); ++v) {
    LedView& view = made.observations.leds[v];
    const auto at = std::find(view.leds.begin(), view.leds.end(), number);
    if (at == view.leds.end()) continue;
    const auto i = static_cast<std::size_t>(at - view.leds.begin());
    view.pixels[i] += (readings.empty() ? 1.5 : -1.5) * Eigen::Vector2d::Ones();
    readings.emplace_back(v, i);
  }
  const auto result = refine(made.truth, made.observations, {.priors = {prior_of(made, number)}});
  EXPECT_TRUE(result) << result.error().message;
  std::vector<char> accepted;
  if (!result) return accepted;
  const std::size_t first = result->views.size() - made.observations.leds.size();
  for (const auto& [v, i] : readings) accepted.push_back(result->views[first + v].inlier[i]);
  return accepted;
}

// By the bar both have redundancy across their lines of sight, and both could be left out, which would leave nothing
// to tell where the end is.
TEST(ScaleBar, AnEndWhoseReadingsContradictEachOtherStays) {
  const auto bar = [](const MadeSystem& made, std::size_t) { return scale_bar(made, 1100, 0.01, 1e-3); };
  EXPECT_EQ(accepted_of_contradicting(bar), (std::vector<char>{1, 1}));
}

// The reading of the tracker whose frame is the world's stays: it alone tells where that tracker's principal point
// lies.
TEST(ScaleBar, AnEndWhosePlaceIsKnownDoesWithoutAReadingThatIsOff) {
  const auto known = [](const MadeSystem& made, std::size_t led) {
    const BlockId block{BlockId::Kind::led, led};
    return Prior::create("known", {{block, 0}, {block, 1}, {block, 2}}, made.truth, 0.01 * Eigen::Matrix3d::Identity())
        .value();
  };
  EXPECT_EQ(accepted_of_contradicting(known), (std::vector<char>{1, 0}));
}

// Lenses that two set-ups share are the same to the last bit, and better known than either alone would tell.
TEST(MovedTrackers, ShareTheirLenses) {
  const MadeSystem made = make_system({.stations = 16, .room_leds = 6, .moved_trackers = true});
  const auto result = refine(disturbed_system(made.truth, 5), made.observations, {});
  ASSERT_TRUE(result) << result.error().message;
  for (const Sensor& sensor : result->state.rig.sensors) {
    if (!sensor.lens_of) continue;
    EXPECT_EQ(sensor.lens.parameters(), result->state.rig.sensors[*sensor.lens_of].lens.parameters());
  }
  const auto& names = result->covariance.names();
  EXPECT_EQ(std::count(names.begin(), names.end(), "track0.fx"), 1);
  EXPECT_EQ(std::count(names.begin(), names.end(), "track0b.fx"), 0);
  EXPECT_EQ(std::count(names.begin(), names.end(), "track0b.translation_x"), 1);
}

// Over independent campaigns the squared error of the LEDs and of a tracker's mount, whitened by its predicted
// covariance, is chi-square distributed.
TEST(TrackedBundleNoise, PredictedSigmasAreTrue) {
  constexpr int kCampaigns = 24;
  double sum = 0;
  int degrees = 0, outside = 0;
  for (int c = 0; c < kCampaigns; ++c) {
    const MadeSystem made = make_system(
        {.projector = false, .stations = 12, .tracker_placements = 10, .seed = 100 + static_cast<unsigned>(c)});
    const auto result = refine(made.truth, made.observations, {});
    ASSERT_TRUE(result) << result.error().message;
    std::vector<BlockId> blocks{{BlockId::Kind::mount, 2}};
    for (std::size_t l = 0; l < made.truth.rig.leds.size(); ++l) blocks.push_back({BlockId::Kind::led, l});
    Eigen::VectorXd error(6 + 3 * made.truth.rig.leds.size());
    error.head<6>() =
        local_step(made.truth.rig.sensors[2].sensor_from_mount, result->state.rig.sensors[2].sensor_from_mount);
    for (std::size_t l = 0; l < made.truth.rig.leds.size(); ++l) {
      error.segment<3>(6 + 3 * static_cast<Eigen::Index>(l)) =
          result->state.rig.leds[l].position_mm - made.truth.rig.leds[l].position_mm;
    }
    const Eigen::MatrixXd covariance = result->covariance.of(blocks, result->state);
    sum += error.dot(covariance.ldlt().solve(error));
    degrees += static_cast<int>(error.size());
    for (Eigen::Index i = 0; i < error.size(); ++i) outside += std::abs(error[i]) > 1.96 * std::sqrt(covariance(i, i));
  }
  EXPECT_NEAR(sum / degrees, 1, 4 * std::sqrt(2.0 / degrees) + 0.05);  // sigmas are estimated: a few percent more
  EXPECT_LT(outside, 0.09 * degrees);
  EXPECT_GT(outside, 0.02 * degrees);
}

}  // namespace
}  // namespace crumple
