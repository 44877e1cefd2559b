#include "tracking/swapped_leds.h"

#include <gtest/gtest.h>

#include "tests/tracking/made_station.h"

namespace crumple {
namespace {

// All trackers take the two for each other.
LedReadings with_swapped(LedReadings readings, std::size_t a, std::size_t b) {
  for (LedReading& reading : readings) std::swap(reading.view.pixels[a], reading.view.pixels[b]);
  return readings;
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

}  // namespace
}  // namespace crumple
