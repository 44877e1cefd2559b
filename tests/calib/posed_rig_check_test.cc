// Stations posed with a rig that may have changed since it was calibrated.
#include "calib/posed_rig_check.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>
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

constexpr std::size_t kScan = 6;  // stations, LEDs alone

std::vector<LedReadings> read_scan(unsigned seed, void (*change)(Rig&),
                                   double led_sigma_px = kPosedRigCampaign.led_sigma_px) {
  MadeSystemOptions options = kPosedRigCampaign;
  options.stations = options.tracker_placements = 0;
  options.wand_stations = kScan;
  options.seed = seed;
  options.change = change;
  options.led_sigma_px = led_sigma_px;
  const MadeSystem made = make_system(options);
  std::vector<LedReadings> readings(kScan);
  for (const LedView& view : made.observations.leds) {
    if (!view.station) continue;
    // As the calibration has it.
    const double sigma_px = kPosedRigCampaign.led_sigma_px;
    const Eigen::Matrix2d noise = sigma_px * sigma_px * Eigen::Matrix2d::Identity();
    readings[*view.station].push_back({view, std::vector<Eigen::Matrix2d>(view.leds.size(), noise)});
  }
  return readings;
}

NamedConstellations posed(const std::vector<LedReadings>& readings) {
  NamedConstellations stations;
  for (const LedReadings& here : readings) {
    auto pose = probe_pose(calibrated_before(), here);
    EXPECT_TRUE(pose) << pose.error().message;
    if (pose) stations.push_back({fmt::format("door_{}", stations.size() + 1), {std::move(*pose), here, {}}});
  }
  return stations;
}

// With `misread` px added to one reading of the third.
NamedConstellations posed_stations(unsigned seed, void (*change)(Rig&), double misread_px = 0,
                                   double led_sigma_px = kPosedRigCampaign.led_sigma_px) {
  std::vector<LedReadings> readings = read_scan(seed, change, led_sigma_px);
  readings[2][0].view.pixels[0].x() += misread_px;
  return posed(readings);
}

// What changed, changed before station `first`; of the same noise before and after.
NamedConstellations changed_meanwhile(unsigned seed, void (*change)(Rig&), std::size_t first) {
  std::vector<LedReadings> readings = read_scan(seed, nullptr);
  const std::vector<LedReadings> later = read_scan(seed, change);
  std::copy(later.begin() + static_cast<std::ptrdiff_t>(first), later.end(),
            readings.begin() + static_cast<std::ptrdiff_t>(first));
  return posed(readings);
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
    const auto check = check_posed_rig(calibrated_before(), posed_stations(seed, nullptr, 0, 0.1), 1);
    ASSERT_TRUE(check) << check.error().message;
    EXPECT_TRUE(check->valid()) << seed;
    // 0.05 px at the calibration.
    ASSERT_EQ(check->noisier.size(), 3U);
    for (const auto& [group, factor] : check->noisier) EXPECT_NEAR(factor, 2, 0.7) << group;
    EXPECT_GT(check->probability, 1e-4);
  }
}

// Each by what its own calibration knows: one that is noisier than the others by itself is as it was.
TEST(PosedRigCheck, TrackersOfUnequalNoiseAreAsTheyWere) {
  Rig rig = calibrated_before();
  const double noisy_px = 3 * kPosedRigCampaign.led_sigma_px;
  rig.sigma_px["track2.leds"] = noisy_px;
  const std::vector<LedReadings> quiet = read_scan(50, nullptr), noisy = read_scan(50, nullptr, noisy_px);
  for (const std::size_t stations : {std::size_t{3}, kScan}) {
    NamedConstellations posed;
    for (std::size_t s = 0; s < stations; ++s) {
      LedReadings here = quiet[s];
      for (std::size_t t = 0; t < here.size(); ++t) {
        if (rig.sensors[here[t].view.sensor].name != "track2") continue;
        here[t] = noisy[s][t];
        for (Eigen::Matrix2d& covariance : here[t].covariances_px2)
          covariance = noisy_px * noisy_px * Eigen::Matrix2d::Identity();
      }
      auto pose = probe_pose(rig, here);
      ASSERT_TRUE(pose) << pose.error().message;
      posed.push_back({fmt::format("door_{}", s + 1), {std::move(*pose), here, {}}});
    }
    const auto check = check_posed_rig(rig, posed, 1);
    ASSERT_TRUE(check) << check.error().message;
    EXPECT_TRUE(check->noisier.empty()) << stations << check->noisier.begin()->first;
    EXPECT_TRUE(check->valid()) << stations;
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

// Whenever it was, by 1 px and by 6, where poses leave the tracker out.
TEST(PosedRigCheck, NamesATrackerMovedWhileTheStationsWereTaken) {
  const std::vector<void (*)(Rig&)> moves{[](Rig& rig) { turn_second_tracker(rig, 6e-4); },
                                          [](Rig& rig) { turn_second_tracker(rig, 4e-3); }};
  for (const std::size_t first : {std::size_t{1}, std::size_t{3}, kScan - 1}) {
    for (const auto& move : moves) {
      const auto check =
          check_posed_rig(calibrated_before(), changed_meanwhile(30 + static_cast<unsigned>(first), move, first), 1);
      ASSERT_TRUE(check) << check.error().message;
      EXPECT_FALSE(check->valid()) << first;
      ASSERT_TRUE(check->moved) << first;
      EXPECT_EQ(check->moved->trackers, std::vector<std::string>{"track1"}) << check->moved->what;
      EXPECT_EQ(check->moved->first_station, first) << check->moved->what;
      EXPECT_TRUE(check->changed.empty());
      EXPECT_THAT(check->moved->what, HasSubstr(fmt::format("track1 stood elsewhere from station door_{}", first + 1)));
    }
  }
}

// A rig that changed before the first station is no move meanwhile, nor is noise.
TEST(PosedRigCheck, WhatLastsIsNoMove) {
  for (unsigned seed = 60; seed < 62; ++seed) {
    const std::vector<NamedConstellations> scans{
        posed_stations(seed, [](Rig& rig) { turn_second_tracker(rig, 4e-3); }),
        posed_stations(seed, [](Rig& rig) { rig.leds[3].position_mm.x() += 2; }),
        posed_stations(seed, nullptr, 0, 0.1)};
    for (const NamedConstellations& scan : scans) {
      const auto check = check_posed_rig(calibrated_before(), scan, 1);
      ASSERT_TRUE(check) << check.error().message;
      EXPECT_FALSE(check->moved) << seed << check->moved->what;
    }
  }
}

// One station at which the LEDs fit no pose, though no reading stands out: the others' poses are sound.
TEST(PosedRigCheck, NamesTheStationWhoseLedsContradictEachOther) {
  std::vector<LedReadings> readings = read_scan(35, nullptr);
  double push_px = 0.12;
  for (LedReading& reading : readings[3]) {
    for (Eigen::Vector2d& pixel : reading.view.pixels) {
      pixel.y() += push_px;
      push_px = -push_px;
    }
  }
  const NamedConstellations stations = posed(readings);
  EXPECT_LT(left_out(stations), 3U);
  const auto misfits = misfitting_stations(calibrated_before(), stations, {});
  ASSERT_EQ(misfits.size(), 1U);
  EXPECT_EQ(misfits[0].name, "door_4");
  EXPECT_TRUE(misfitting_stations(calibrated_before(), posed_stations(35, nullptr), {}).empty());
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
