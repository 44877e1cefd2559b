// What is stated of a pose whose LEDs scatter more than they were taken to.
#include "calib/station_poses.h"

#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include "solvers/bundle.h"
#include "tests/calib/tracked_probe.h"
#include "tests/solvers/made_system.h"
#include "tracking/probe_pose.h"

namespace crumple {
namespace {

constexpr double kTaken_px = 0.05;
constexpr unsigned kDraws = 150;

// Squared errors of poses by the covariance, per degree of freedom; one tracker is three times as noisy as taken for.
TEST(StationPoses, HoldNoiseThatTurnedOutLarger) {
  double stated = 0, restated = 0;
  int poses = 0;
  for (unsigned seed = 1; seed <= kDraws; ++seed) {
    MadeSystemOptions options{
        .trackers = 3, .projector = false, .stations = 0, .wand_stations = 4, .tracker_placements = 0};
    options.led_sigma_px = kTaken_px;
    options.seed = seed;
    const MadeSystem made = make_system(options);
    options.led_sigma_px = 3 * kTaken_px;
    const MadeSystem noisy = make_system(options);
    Rig rig = made.truth.rig;
    for (std::size_t s = 1; s < 4; ++s) rig.sigma_px[group_name(rig, s, View::Kind::leds)] = kTaken_px;
    const NoiseFactors noisier{{group_name(rig, 1, View::Kind::leds), 3.0}};
    for (std::size_t station = 0; station < made.truth.world_from_probe.size(); ++station) {
      LedReadings readings;
      for (std::size_t v = 0; v < made.observations.leds.size(); ++v) {
        const LedView& view = (made.observations.leds[v].sensor == 1 ? noisy : made).observations.leds[v];
        if (view.station != station) continue;
        const Eigen::Matrix2d noise = kTaken_px * kTaken_px * Eigen::Matrix2d::Identity();
        readings.push_back({view, std::vector<Eigen::Matrix2d>(view.leds.size(), noise)});
      }
      const auto pose = probe_pose(rig, readings, {.gate = 1e9});
      ASSERT_TRUE(pose) << pose.error().message;
      const auto covariance = pose_covariance(rig, readings, pose->world_from_probe, noisier);
      ASSERT_TRUE(covariance) << covariance.error().message;
      const auto as_taken = pose_covariance(rig, readings, pose->world_from_probe, {});
      ASSERT_TRUE(as_taken);
      EXPECT_LT((*as_taken - pose->covariance).norm(), 1e-6 * pose->covariance.norm());
      const Vector6d error = local_step(made.truth.world_from_probe[station], pose->world_from_probe);
      stated += error.dot(pose->covariance.inverse() * error) / 6;
      restated += error.dot(covariance->inverse() * error) / 6;
      ++poses;
    }
  }
  EXPECT_NEAR(restated / poses, 1, 4 * std::sqrt(2.0 / 6 / poses));
  EXPECT_GT(stated / poses, 1.5);
}

// Rigs and LED pixels drawn anew: what is left of the LEDs at a pose is chi-square distributed, with what the rig is
// off by counted, which by the pixels' noise alone is too much.
TEST(StationPoses, MisfitsAreChiSquare) {
  TrackedProbe probe;
  std::mt19937 random(12);
  const Eigen::MatrixXd root = correlated_root(probe, random);
  constexpr int kRigs = 200;
  double square = 0, by_noise_alone = 0, freedom = 0;
  int improbable = 0;
  for (int draw = 0; draw < kRigs; ++draw) {
    Rig rig = drawn_rig(probe, root, random);
    rig.covariance = {probe.truth.rig.covariance.names, root * root.transpose()};
    const LedReadings seen = drawn_readings(probe, random)[0];
    const auto pose = probe_pose(rig, seen, {.gate = 1e9});
    ASSERT_TRUE(pose) << pose.error().message;
    const auto misfit = pose_misfit(rig, seen, pose->world_from_probe, {});
    ASSERT_TRUE(misfit) << misfit.error().message;
    EXPECT_EQ(misfit->redundancy, pose->redundancy);
    square += misfit->chi_square;
    by_noise_alone += pose->chi_square;
    freedom += misfit->redundancy;
    improbable += misfit->probability < 0.05 ? 1 : 0;
  }
  EXPECT_NEAR(square / freedom, 1, 4 * std::sqrt(2 / freedom));
  EXPECT_NEAR(improbable, 0.05 * kRigs, 4 * std::sqrt(0.05 * 0.95 * kRigs));
  EXPECT_GT(by_noise_alone, 1.2 * square);
}

}  // namespace
}  // namespace crumple
