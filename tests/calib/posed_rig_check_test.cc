// Stations posed with a rig that may have changed since it was calibrated.
#include "calib/posed_rig_check.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/calib/made_system_data.h"
#include "tracking/probe_pose.h"

namespace crumple {
namespace {

using testing::HasSubstr;

constexpr MadeSystemOptions kPosedRigCampaign{.trackers = 3, .projector = false, .stations = 20};

const Rig& calibrated_before() {
  static const Rig rig =
      calibrated_rig(calibrate(data_of(make_system(kPosedRigCampaign)), {.warp = WarpChoice::off}).value());
  return rig;
}

using NamedConstellations = std::vector<std::pair<std::string, Constellation>>;

// Six stations of a scan, LEDs alone, with `misread` px added to one reading of the third.
NamedConstellations posed_stations(unsigned seed, void (*change)(Rig&), double misread_px = 0,
                                   double led_sigma_px = kPosedRigCampaign.led_sigma_px) {
  MadeSystemOptions options = kPosedRigCampaign;
  options.stations = options.tracker_placements = 0;
  options.wand_stations = 6;
  options.seed = seed;
  options.change = change;
  options.led_sigma_px = led_sigma_px;
  const MadeSystem made = make_system(options);
  std::vector<LedReadings> readings(6);
  for (const LedView& view : made.observations.leds) {
    if (!view.station) continue;
    const Eigen::Matrix2d noise = options.led_sigma_px * options.led_sigma_px * Eigen::Matrix2d::Identity();
    readings[*view.station].push_back({view, std::vector<Eigen::Matrix2d>(view.leds.size(), noise)});
  }
  readings[2][0].view.pixels[0].x() += misread_px;
  NamedConstellations stations;
  for (const LedReadings& here : readings) {
    auto pose = probe_pose(calibrated_before(), here);
    EXPECT_TRUE(pose) << pose.error().message;
    if (pose) stations.push_back({"station", {std::move(*pose), here, {}}});
  }
  return stations;
}

std::size_t left_out(const NamedConstellations& stations) {
  std::size_t count = 0;
  for (const auto& [name, where] : stations) {
    for (const LedResidual& residual : where.pose.residuals) count += residual.used ? 0 : 1;
  }
  return count;
}

void turn_second_tracker(Rig& rig, double turn_rad) {
  Vector6d step = Vector6d::Zero();
  step[1] = turn_rad;
  Pose& pose = rig.sensors[2].sensor_from_mount;
  pose = retract(pose, step);
}

TEST(PosedRigCheck, FindsNothingWhereNothingChanged) {
  for (unsigned seed = 10; seed < 20; ++seed) {
    const auto check = check_posed_rig(calibrated_before(), posed_stations(seed, nullptr), 1);
    ASSERT_TRUE(check) << check.error().message;
    EXPECT_TRUE(check->valid()) << seed;
    EXPECT_GT(check->probability, 1e-4) << seed;
    for (const auto& [group, factor] : check->noisier) EXPECT_LT(factor, 1.5) << group;
  }
}

// Air that shimmers is no change of the rig.
TEST(PosedRigCheck, NoisierReadingsThanAtTheCalibrationAreNoChange) {
  for (unsigned seed = 40; seed < 46; ++seed) {
    const auto check = check_posed_rig(calibrated_before(), posed_stations(seed, nullptr, 0, 0.15), 1);
    ASSERT_TRUE(check) << check.error().message;
    EXPECT_TRUE(check->valid()) << seed;
    // 0.05 px at the calibration.
    ASSERT_EQ(check->noisier.size(), 3U);
    for (const auto& [group, factor] : check->noisier) EXPECT_NEAR(factor, 3, 1) << group;
    EXPECT_GT(check->probability, 1e-4);
  }
}

// The gate on single readings lets pass what all of them together show.
TEST(PosedRigCheck, NamesATrackerTurnedByLessThanAReadingShows) {
  const auto stations = posed_stations(30, [](Rig& rig) { turn_second_tracker(rig, 1.5e-4); });
  const auto check = check_posed_rig(calibrated_before(), stations, 1);
  ASSERT_TRUE(check) << check.error().message;
  ASSERT_FALSE(check->valid());
  EXPECT_EQ(check->parts[check->changed[0].part].name, "the place of track1");
  EXPECT_NEAR(check->parts[check->changed[0].part].change[1], 1.5e-4, 1e-4);
  EXPECT_LT(left_out(stations), 10U);
}

// Most of its readings are left out everywhere, and the poses look sound.
TEST(PosedRigCheck, NamesATrackerThatEveryPoseLeavesOut) {
  const auto stations = posed_stations(31, [](Rig& rig) { turn_second_tracker(rig, 4e-3); });
  EXPECT_GE(left_out(stations), 24U);
  const auto check = check_posed_rig(calibrated_before(), stations, 1);
  ASSERT_TRUE(check) << check.error().message;
  ASSERT_FALSE(check->valid());
  EXPECT_EQ(check->parts[check->changed[0].part].name, "the place of track1");
}

TEST(PosedRigCheck, NamesTheLedThatWasBent) {
  const auto stations = posed_stations(32, [](Rig& rig) { rig.leds[3].position_mm.x() += 2; });
  const auto check = check_posed_rig(calibrated_before(), stations, 1);
  ASSERT_TRUE(check) << check.error().message;
  ASSERT_FALSE(check->valid());
  EXPECT_EQ(check->parts[check->changed[0].part].name, "LED led3");
}

TEST(PosedRigCheck, AMisreadLedIsNoChange) {
  const auto stations = posed_stations(33, nullptr, 20);
  EXPECT_EQ(left_out(stations), 1U);
  const auto check = check_posed_rig(calibrated_before(), stations, 1);
  ASSERT_TRUE(check) << check.error().message;
  EXPECT_TRUE(check->valid());
}

TEST(PosedRigCheck, RefusesWhatTellsNothing) {
  Rig without = calibrated_before();
  without.covariance = {};
  auto stations = posed_stations(34, nullptr);
  const auto unknown = check_posed_rig(without, stations, 1);
  ASSERT_FALSE(unknown);
  EXPECT_THAT(unknown.error().message, HasSubstr("no covariance"));
  for (auto& [name, where] : stations) where.pose.choice.emplace();
  EXPECT_FALSE(check_posed_rig(calibrated_before(), stations, 1));
}

}  // namespace
}  // namespace crumple
