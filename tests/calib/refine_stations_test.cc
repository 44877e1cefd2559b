// Stations refined together: a made car side, scanned by a probe whose rig a made campaign calibrated.
#include "calib/refine_stations.h"

#include <algorithm>
#include <cmath>
#include <map>

#include <Eigen/Cholesky>
#include <gtest/gtest.h>

#include "calib/calibrate.h"
#include "calib/refined_knowledge.h"
#include "tests/calib/made_car.h"

namespace crumple {
namespace {

constexpr MadeCarOptions kOptions{.campaign_stations = 12, .tracker_boards = 12, .columns = 4, .rows = 1, .balls = 0};

// A rig by its own campaign, and a car measured with it.
struct Measured {
  Rig rig;
  MadeCar car;
  std::vector<ObservedStation> stations;
};

Expected<Measured> measured(MadeCarOptions options, unsigned seed) {
  const MadeCampaign campaign = make_car_campaign(options, seed);
  const auto calibration = refine(campaign.truth, campaign.observations, {.reject_outliers = false, .threads = 2});
  if (!calibration) return tl::unexpected(calibration.error());
  Measured result{calibration->state.rig, make_car(options, 100 + seed), {}};
  result.rig.covariance = rig_covariance(*calibration);
  auto placed = placed_by(result.rig, result.car, options.led_sigma_px);
  if (!placed) return tl::unexpected(placed.error());
  result.stations = std::move(*placed);
  return result;
}

const StationRefinementOptions kIndependent{.overlap_inflation = 1, .threads = 2};

// From one station's frame to another's: what the frame of the world does not touch.
double relative_error_mm(const std::vector<Pose>& found, const std::vector<Pose>& truth) {
  double squares = 0;
  for (std::size_t s = 0; s + 1 < truth.size(); ++s) {
    const Eigen::Vector3d ahead(0, 0, 800);
    const Eigen::Vector3d is = found[s].inverse() * (found[s + 1] * ahead);
    squares += (is - truth[s].inverse() * (truth[s + 1] * ahead)).squaredNorm();
  }
  return std::sqrt(squares / static_cast<double>(truth.size() - 1));
}

TEST(RefineStations, IsNeverWorseThanLedsAloneAndAsItsCovarianceSays) {
  double square = 0;
  int degrees = 0;
  for (unsigned seed = 1; seed <= 4; ++seed) {
    const auto data = measured(kOptions, seed);
    ASSERT_TRUE(data) << data.error().message;
    const auto refined = refine_stations(data->rig, data->stations, {}, kIndependent);
    ASSERT_TRUE(refined) << refined.error().message;
    EXPECT_EQ(refined->overlaps, 3U);
    // What is kept of it for points' uncertainty says the same of each pose.
    const auto known = refined_knowledge(data->rig, data->stations, *refined);
    ASSERT_TRUE(known) << known.error().message;
    const Eigen::MatrixXd& by_rig = known->poses.d_rig;
    const Eigen::MatrixXd kept = by_rig * known->covariance.matrix * by_rig.transpose() + known->poses.covariance;
    EXPECT_LT(known->covariance.matrix.diagonal().minCoeff() / data->rig.covariance.matrix.diagonal().minCoeff(), 1.01);
    std::vector<Pose> by_leds, found;
    for (std::size_t s = 0; s < data->stations.size(); ++s) {
      const auto six = 6 * static_cast<Eigen::Index>(s);
      const Matrix6d& stated = refined->stations[s].covariance;
      EXPECT_LT((kept.block<6, 6>(six, six) - stated).norm(), 1e-6 * stated.norm());
      by_leds.push_back(data->stations[s].world_from_probe);
      found.push_back(refined->stations[s].world_from_probe);
      EXPECT_LT(refined->stations[s].covariance.trace(), refined->stations[s].covariance_by_leds.trace());
      const Vector6d error = local_step(data->car.truth.world_from_probe[s], found.back());
      square += error.dot(refined->stations[s].covariance.ldlt().solve(error));
      degrees += 6;
    }
    EXPECT_LT(relative_error_mm(found, data->car.truth.world_from_probe),
              relative_error_mm(by_leds, data->car.truth.world_from_probe))
        << "seed " << seed;
  }
  // Stations of one seed share the rig's error: fewer independent ones than there are degrees.
  EXPECT_NEAR(square / degrees, 1, 0.6);
}

TEST(RefineStations, TargetsTellMore) {
  MadeCarOptions options = kOptions;
  options.targets_per_overlap = 6;
  const auto data = measured(options, 7);
  ASSERT_TRUE(data) << data.error().message;
  EXPECT_FALSE(refine_stations(data->rig, data->stations, {}, kIndependent));  // readings of targets that are not given
  auto untargeted = data->stations;
  for (ObservedStation& station : untargeted) station.targets.clear();
  const auto without = refine_stations(data->rig, untargeted, {}, kIndependent);
  ASSERT_TRUE(without) << without.error().message;
  const auto with = refine_stations(data->rig, data->stations, data->car.targets, kIndependent);
  ASSERT_TRUE(with) << with.error().message;
  EXPECT_EQ(with->targets.size(), data->car.targets.size());
  for (std::size_t s = 0; s < data->stations.size(); ++s) {
    EXPECT_LT(with->stations[s].covariance.trace(), without->stations[s].covariance.trace()) << s;
  }
}

// The reading that is wrong goes, and the others stay.
TEST(RefineStations, OfMoreReadingsOfATargetOneMayBeWrong) {
  MadeCarOptions options = kOptions;
  options.rows = 2;
  options.targets_per_overlap = 6;
  auto data = measured(options, 7);
  ASSERT_TRUE(data) << data.error().message;
  std::map<std::size_t, std::vector<Eigen::Vector2d*>> pixels;
  for (ObservedStation& station : data->stations) {
    for (TargetReading& reading : station.targets) {
      for (std::size_t i = 0; i < reading.targets.size(); ++i) {
        pixels[reading.targets[i]].push_back(&reading.pixels[i]);
      }
    }
  }
  const auto seen_often =
      std::find_if(pixels.begin(), pixels.end(), [](const auto& of_target) { return of_target.second.size() > 2; });
  ASSERT_NE(seen_often, pixels.end());
  *seen_often->second.front() += Eigen::Vector2d(60, -40);
  const auto refined = refine_stations(data->rig, data->stations, data->car.targets, kIndependent);
  ASSERT_TRUE(refined) << refined.error().message;
  EXPECT_EQ(refined->targets_used, data->car.targets.size());
}

TEST(RefineStations, ATargetWhoseTwoReadingsDisagreeSaysNothing) {
  MadeCarOptions options = kOptions;
  options.targets_per_overlap = 6;
  auto data = measured(options, 7);
  ASSERT_TRUE(data) << data.error().message;
  std::vector<std::vector<Eigen::Vector2d*>> pixels(data->car.targets.size());
  for (ObservedStation& station : data->stations) {
    for (TargetReading& reading : station.targets) {
      for (std::size_t i = 0; i < reading.targets.size(); ++i) {
        pixels[reading.targets[i]].push_back(&reading.pixels[i]);
      }
    }
  }
  const auto seen_twice =
      std::find_if(pixels.begin(), pixels.end(), [](const auto& of_target) { return of_target.size() == 2; });
  ASSERT_NE(seen_twice, pixels.end());
  *seen_twice->front() += Eigen::Vector2d(60, -40);
  const auto spoiled = refine_stations(data->rig, data->stations, data->car.targets, kIndependent);
  ASSERT_TRUE(spoiled) << spoiled.error().message;

  const auto target = static_cast<std::size_t>(seen_twice - pixels.begin());
  EXPECT_EQ(spoiled->targets_used, data->car.targets.size() - 1);
  EXPECT_EQ(spoiled->targets[target].position_mm, data->car.targets[target].position_mm);
  for (ObservedStation& station : data->stations) {
    for (TargetReading& reading : station.targets) {
      const auto at = std::find(reading.targets.begin(), reading.targets.end(), target);
      if (at == reading.targets.end()) continue;
      reading.pixels.erase(reading.pixels.begin() + (at - reading.targets.begin()));
      reading.targets.erase(at);
    }
  }
  const auto without = refine_stations(data->rig, data->stations, data->car.targets, kIndependent);
  ASSERT_TRUE(without) << without.error().message;
  for (std::size_t s = 0; s < data->stations.size(); ++s) {
    const Vector6d step = local_step(without->stations[s].world_from_probe, spoiled->stations[s].world_from_probe);
    const Matrix6d& covariance = without->stations[s].covariance;
    EXPECT_LT(step.head<3>().norm(), 0.2 * std::sqrt(covariance.topLeftCorner<3, 3>().trace())) << s;
    EXPECT_LT(step.tail<3>().norm(), 0.2 * std::sqrt(covariance.bottomRightCorner<3, 3>().trace())) << s;
  }
}

// Few LEDs are read here, too few to tell their noise by each tracker.
TEST(RefineStations, BadlyReadTargetsSayNothingOfTheTrackersNoise) {
  MadeCarOptions options = kOptions;
  options.targets_per_overlap = 20;
  options.target_sigma_px = 1;
  const auto data = measured(options, 7);
  ASSERT_TRUE(data) << data.error().message;
  const auto refined = refine_stations(data->rig, data->stations, data->car.targets, kIndependent);
  ASSERT_TRUE(refined) << refined.error().message;
  for (const GroupSummary& group : refined->bundle.groups) {
    if (data->rig.sensors[group.sensor].mount != Mount::world) continue;
    EXPECT_NEAR(group.sigma_px / options.led_sigma_px, 1, 0.4) << group.sensor;
  }
}

TEST(RefineStations, OverlapAloneIsRefused) {
  auto data = measured(kOptions, 3);
  ASSERT_TRUE(data) << data.error().message;
  auto stations = data->stations;
  for (ObservedStation& station : stations) station.readings.clear();
  const auto refused = refine_stations(data->rig, stations, {}, kIndependent);
  ASSERT_FALSE(refused);
  EXPECT_NE(refused.error().message.find("overlap alone"), std::string::npos) << refused.error().message;
  data->rig.covariance = {};
  EXPECT_FALSE(refine_stations(data->rig, data->stations, {}, kIndependent));
}

// A door that was opened between two stations: its surface agrees with itself and not with the LEDs.
TEST(RefineStations, ASurfaceThatMovedIsRefused) {
  auto data = measured(kOptions, 3);
  ASSERT_TRUE(data) << data.error().message;
  const Eigen::Vector3d aside(0, 0, 6);
  for (std::size_t s = 2; s < 4; ++s) {
    for (SurfacePatch& patch : data->stations[s].surfaces[0].patches) {
      // As if decoded farther away: 6 mm of 800 are 3.5 px.
      patch.coordinate_px -= 3.5;
      patch.position_mm += aside;
    }
  }
  const auto refused = refine_stations(data->rig, data->stations, {}, kIndependent);
  ASSERT_FALSE(refused);
  EXPECT_NE(refused.error().message.find("contradict"), std::string::npos) << refused.error().message;
}

TEST(RefineStations, TheSameBitsAtAnyThreadCount) {
  const auto data = measured(kOptions, 2);
  ASSERT_TRUE(data) << data.error().message;
  StationRefinementOptions one = kIndependent, three = kIndependent;
  one.threads = 1;
  three.threads = 3;
  const auto a = refine_stations(data->rig, data->stations, {}, one);
  const auto b = refine_stations(data->rig, data->stations, {}, three);
  ASSERT_TRUE(a && b);
  for (std::size_t s = 0; s < a->stations.size(); ++s) {
    EXPECT_EQ(a->stations[s].world_from_probe.translation, b->stations[s].world_from_probe.translation);
    EXPECT_EQ(a->stations[s].covariance, b->stations[s].covariance);
  }
}

}  // namespace
}  // namespace crumple
