#include "tracking/swapped_leds.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/tracking/made_station.h"
#include "tracking/constellation.h"

namespace crumple {
namespace {

// All trackers take the two for each other.
LedReadings with_swapped(LedReadings readings, std::size_t a, std::size_t b) {
  for (LedReading& reading : readings) std::swap(reading.view.pixels[a], reading.view.pixels[b]);
  return readings;
}

// What the readings' trackers tell of lights, one that blinks the word of each LED.
std::vector<TrackerLights> lights_of(const LedReadings& readings) {
  std::vector<TrackerLights> trackers;
  for (const LedReading& reading : readings) {
    TrackerLights tracker{reading.view.sensor, {}};
    for (std::size_t i = 0; i < reading.view.leds.size(); ++i) {
      Light light;
      light.pixel = light.centre_of_gravity_px = reading.view.pixels[i];
      light.covariance_px2 = reading.covariances_px2[i];
      tracker.lights.leds.push_back({reading.view.leds[i], light});
    }
    trackers.push_back(std::move(tracker));
  }
  return trackers;
}

// Five LEDs before one tracker are too few for a pose without the two; before more there is one.
TEST(SwappedLeds, AreFoundWithAPoseAndWithoutOne) {
  std::mt19937 random(31);
  for (const int trackers : {1, 2, 3}) {
    const MadeStation station = make_station({.leds = 5, .trackers = trackers});
    for (std::size_t a = 0; a < 5; ++a) {
      for (std::size_t b = a + 1; b < 5; ++b) {
        const LedReadings readings = with_swapped(with_noise(station.readings, random), a, b);
        const auto pose = probe_pose(station.rig, readings);
        EXPECT_EQ(pose.has_value(), trackers > 1) << a << b;
        const auto found = find_swapped_leds(station.rig, readings, pose);
        ASSERT_TRUE(found) << trackers << a << b;
        EXPECT_EQ(*found, std::pair(a, b)) << trackers;
      }
    }
  }
}

TEST(SwappedLeds, NoneWhereAllIsRight) {
  std::mt19937 random(32);
  const MadeStation station = make_station({.leds = 5, .trackers = 2});
  const LedReadings readings = with_noise(station.readings, random);
  EXPECT_FALSE(find_swapped_leds(station.rig, readings, probe_pose(station.rig, readings)));
}

// Two LEDs that were bent are wrong in all trackers, too.
TEST(SwappedLeds, NoneWhereTwoLedsWereBent) {
  std::mt19937 random(33);
  MadeStation station = make_station({.leds = 6, .trackers = 2});
  const LedReadings readings = with_noise(station.readings, random);
  station.rig.leds[1].position_mm.x() += 15;
  station.rig.leds[4].position_mm.y() -= 15;
  const auto pose = probe_pose(station.rig, readings);
  ASSERT_TRUE(pose) << pose.error().message;
  EXPECT_FALSE(find_swapped_leds(station.rig, readings, pose));
}

// Triangulated markers alone have a pose of swapped LEDs too.
TEST(SwappedLeds, AreNamedByEitherPose) {
  std::mt19937 random(34);
  const MadeStation station = make_station({.leds = 5, .trackers = 2});
  const std::vector<TrackerLights> trackers = lights_of(with_noise(station.readings, random));
  const auto settled_both_ways = [&](const std::vector<std::size_t>& led_of_word) {
    return std::vector{settle_constellation(station.rig, trackers, led_of_word),
                       settle_by_markers(station.rig, trackers, led_of_word)};
  };
  for (const Expected<Constellation>& settled : settled_both_ways({0, 1, 2, 3, 4})) {
    ASSERT_TRUE(settled) << settled.error().message;
    const Vector6d off = local_step(station.world_from_probe, settled->pose.world_from_probe);
    EXPECT_LT(off.tail<3>().norm(), 2);  // mm, of 3 m
  }
  for (const Expected<Constellation>& settled : settled_both_ways({0, 3, 2, 1, 4})) {
    ASSERT_FALSE(settled);
    EXPECT_THAT(settled.error().message, testing::HasSubstr("LEDs led1 and led3 seem swapped"));
  }
}

}  // namespace
}  // namespace crumple
