#include "calib/uncertainty_budget.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "calib/weighting.h"
#include "tests/calib/made_system_data.h"
#include "tests/calib/synthetic_data.h"

namespace crumple {
namespace {

CalibrationData certified_data() {
  CalibrationData data = data_of(
      make_synthetic({.placements = 6, .corner_sigma_px = 0.1, .stripe_sigma_px = 0.05, .feature_sigma_px = 0.1}));
  data.boards[0].certificate = BoardCertificate{.pitch_sigma_mm = 0.08};  // 0.2 % of the pitch
  return data;
}

const BudgetEntry& entry_named(const UncertaintyBudget& budget, const std::string& name) {
  return *std::find_if(budget.entries.begin(), budget.entries.end(),
                       [&](const BudgetEntry& entry) { return entry.name == name; });
}

void expect_complete(const UncertaintyBudget& budget) {
  for (const BudgetEntry& entry : budget.entries) {
    EXPECT_NEAR(std::accumulate(entry.shares.begin(), entry.shares.end(), 0.0), 1, 1e-6) << entry.name;
  }
}

TEST(UncertaintyBudget, SourcesAddUpToTheCovariance) {
  const CalibrationData data = certified_data();
  const Calibration calibration = calibrate(data, {.warp = WarpChoice::on}).value();
  const UncertaintyBudget budget = uncertainty_budget(data.observations, calibration, 1);
  ASSERT_EQ(static_cast<int>(budget.entries.size()), calibration.bundle.covariance.rig_rows());
  expect_complete(budget);
  // Type B is the certificate alone: of the scale all, of a translation what the scale moves, of a lens nothing.
  const BudgetEntry& scale = entry_named(budget, "board.scale");
  EXPECT_NEAR(scale.type_b_share, 1, 1e-9);
  EXPECT_EQ(scale.degrees_of_freedom, INFINITY);
  const BudgetEntry& along = entry_named(budget, "proj0.translation_x");
  EXPECT_NEAR(along.type_b_share * along.u * along.u, std::pow(0.002 * along.value, 2), 1e-4 * along.u * along.u);
  EXPECT_LT(entry_named(budget, "cam0.fx").type_b_share, 1e-6);
}

TEST(UncertaintyBudget, DegreesOfFreedomAreTheGroups) {
  const CalibrationData data = certified_data();
  const Calibration calibration = calibrate(data, {.warp = WarpChoice::on}).value();
  const UncertaintyBudget budget = uncertainty_budget(data.observations, calibration, 2);
  const GroupSummary& corners = calibration.bundle.groups.front();
  EXPECT_EQ(budget.sources.front().name, "cam0.corners");
  // Less than its redundancy by what it shares with the projector's readings.
  const double redundancy = corners.redundancy / calibration.inflation.corners;
  EXPECT_LT(budget.sources.front().sigma_degrees_of_freedom, redundancy);
  EXPECT_GT(budget.sources.front().sigma_degrees_of_freedom, 0.95 * redundancy);
  EXPECT_EQ(budget.sources.front().inflation_degrees_of_freedom, calibration.inflation.corner_degrees_of_freedom);
  // Welch and Satterthwaite: between the fewest of the sources and their sum.
  double fewest = INFINITY, sum = 0;
  for (const BudgetSource& source : budget.sources) {
    fewest = std::min(fewest, source.degrees_of_freedom());
    if (!source.type_b) sum += source.degrees_of_freedom();
  }
  const double degrees = entry_named(budget, "cam0.fx").degrees_of_freedom;
  EXPECT_GT(degrees, fewest);
  EXPECT_LT(degrees, sum);
}

TEST(UncertaintyBudget, GroupsOfAKindHaveOneInflation) {
  const std::vector<BudgetSource> sources{{"a.corners", false, 200, View::Kind::corners, {1.0 / 200, 0, 0}, 50},
                                          {"b.corners", false, 100, View::Kind::corners, {0, 1.0 / 100, 0}, 50},
                                          {"p.stripes", false, 1000, View::Kind::stripes, {0, 0, 1.0 / 1000}, 80},
                                          {"certificates", true}};
  EXPECT_NEAR(sources[0].degrees_of_freedom(), 40, 1e-12);
  EXPECT_NEAR(effective_degrees_of_freedom(sources, {1, 0, 0, 0}), 40, 1e-12);
  // However many cameras tell the same, how far their corners are correlated is known once.
  EXPECT_NEAR(effective_degrees_of_freedom(sources, {0.5, 0.5, 0, 0}), 1 / (0.25 / 200 + 0.25 / 100 + 1.0 / 50), 1e-12);
  EXPECT_NEAR(effective_degrees_of_freedom(sources, {0.5, 0, 0.3, 0.2}), 1 / (0.25 / 40 + 0.09 / 1000 + 0.09 / 80),
              1e-12);
  EXPECT_EQ(effective_degrees_of_freedom(sources, {0, 0, 0, 1}), INFINITY);
}

// Estimates that are correlated: what one has too much the other has too little, so that of equal shares the sum is
// known better than either.
TEST(UncertaintyBudget, SigmasAreCorrelated) {
  const std::vector<BudgetSource> sources{{"a.leds", false, 50, View::Kind::leds, {0.02, -0.01}},
                                          {"b.leds", false, 50, View::Kind::leds, {-0.01, 0.02}}};
  EXPECT_NEAR(effective_degrees_of_freedom(sources, {1, 0}), 50, 1e-12);
  EXPECT_NEAR(effective_degrees_of_freedom(sources, {0.5, 0.5}), 200, 1e-12);
}

const BudgetRegion& region_named(const UncertaintyBudget& budget, const std::string& part) {
  return *std::find_if(budget.regions.begin(), budget.regions.end(),
                       [&](const BudgetRegion& region) { return region.part == part; });
}

// Of one estimated sigma the region is exactly F's.
TEST(UncertaintyBudget, RegionsOfOneSigmaAreScheffes) {
  Synthetic made = make_synthetic({.placements = 6, .corner_sigma_px = 0.1});
  made.truth.rig.sensors.pop_back();
  const Observations corners{made.observations.placement_count, made.observations.corners, {}, {}};
  Calibration calibration{.start = made.truth, .bundle = refine(made.truth, corners, {}).value()};
  add_weighting(corners, {.reject_outliers = false}, calibration);
  const UncertaintyBudget budget = uncertainty_budget(corners, calibration, 1);
  const BudgetRegion& lens = region_named(budget, "lens of cam0");
  EXPECT_EQ(lens.dimension, 9);
  const double degrees = calibration.bundle.groups[0].redundancy;
  EXPECT_NEAR(lens.degrees_of_freedom / degrees, 1, 1e-6);
  EXPECT_NEAR(lens.scale, 1, 1e-9);
  EXPECT_NEAR(lens.mean, degrees / (degrees - 2), 1e-9);
}

// Placements and stations, one kind of them eliminated; LEDs, trackers, a mount's rotation in degrees.
TEST(UncertaintyBudget, OfATrackedProbe) {
  const MadeSystem made = make_system({.stations = 8, .tracker_placements = 6});
  const auto bundle = refine(made.truth, made.observations, {});
  ASSERT_TRUE(bundle) << bundle.error().message;
  Calibration calibration{.start = made.truth, .bundle = *bundle};
  add_weighting(made.observations, {}, calibration);
  const UncertaintyBudget budget = uncertainty_budget(made.observations, calibration, 1);
  expect_complete(budget);
  EXPECT_EQ(region_named(budget, "LEDs").dimension, 15);
  EXPECT_EQ(region_named(budget, "all").dimension, static_cast<int>(budget.entries.size()));
  // Trackers' sigmas are known from a hundred readings or so: that is felt by LEDs, hardly by the camera.
  EXPECT_GT(region_named(budget, "LEDs").mean, region_named(budget, "lens of cam0").mean);
  EXPECT_GT(region_named(budget, "LEDs").degrees_of_freedom, 30);
  const BudgetEntry& rotation = entry_named(budget, "track1.rotation_y");
  EXPECT_EQ(rotation.unit, "deg");
  EXPECT_EQ(rotation.part, "mount of track1");
  const auto& covariance = calibration.bundle.covariance;
  const auto& names = covariance.names();
  const auto row = std::find(names.begin(), names.end(), rotation.name) - names.begin();
  EXPECT_NEAR(rotation.u, std::sqrt(covariance.common()(row, row)) * 180 / std::numbers::pi, 1e-12);
}

}  // namespace
}  // namespace crumple
