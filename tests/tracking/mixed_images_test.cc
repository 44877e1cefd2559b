#include "tracking/mixed_images.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/tracking/made_station.h"

namespace crumple {
namespace {

using testing::HasSubstr;
using testing::Optional;

TEST(MixedImages, TrackersWithEachOthersAreNamed) {
  std::mt19937 random(41);
  for (const int trackers : {2, 3, 4}) {
    const MadeStation station = make_station({.leds = 5, .trackers = trackers});
    LedReadings readings = with_noise(station.readings, random);
    std::swap(readings[0].view.pixels, readings[1].view.pixels);
    EXPECT_THAT(find_mixed_images(station.rig, readings),
                Optional(HasSubstr("tracker0 and tracker1 seem to have each")))
        << trackers;
  }
}

TEST(MixedImages, ATrackerWithThoseOfAnotherStationIsNamedWhereOthersOutvoteIt) {
  std::mt19937 random(42);
  for (const int trackers : {2, 3, 4}) {
    const MadeStation station = make_station({.leds = 5, .trackers = trackers});
    LedReadings readings = with_noise(station.readings, random);
    readings[1].view.pixels = make_station({.leds = 5, .trackers = trackers}, 0.4).readings[1].view.pixels;
    EXPECT_THAT(find_mixed_images(station.rig, readings),
                Optional(HasSubstr(trackers == 2 ? "tracker0 and tracker1 tell poses" : "without tracker1")))
        << trackers;
  }
}

// One that read nothing agrees with nobody.
TEST(MixedImages, OfTwoThatDisagreeBesideOneThatReadNothingEitherMayBeIt) {
  std::mt19937 random(43);
  const MadeStation station = make_station({.leds = 5, .trackers = 3});
  LedReadings readings = with_noise(station.readings, random);
  readings[1].view.pixels = make_station({.leds = 5, .trackers = 3}, 0.4).readings[1].view.pixels;
  readings[2].view.leds.clear();
  readings[2].view.pixels.clear();
  readings[2].covariances_px2.clear();
  EXPECT_THAT(find_mixed_images(station.rig, readings), Optional(HasSubstr("tracker0 and tracker1 tell poses")));
}

TEST(MixedImages, LedsThatWereBentAreNoneOfThem) {
  std::mt19937 random(43);
  MadeStation station = make_station({.leds = 5, .trackers = 3});
  for (const std::size_t led : {0U, 2U, 3U}) station.rig.leds[led].position_mm.y() += 20;
  EXPECT_EQ(find_mixed_images(station.rig, with_noise(station.readings, random)), std::nullopt);
}

TEST(MixedImages, TheSameOnesHaveLightsAtTheSamePlaces) {
  const auto lights_at = [](std::vector<double> columns_px) {
    Identification lights;
    for (const double x : columns_px) {
      Light light;
      light.pixel = {x, 20.25};
      lights.leds.push_back({lights.leds.size(), light});
    }
    return lights;
  };
  const Identification one = lights_at({10.5, 33.125, 70.75});
  EXPECT_TRUE(same_images(one, one));
  EXPECT_TRUE(same_images(one, lights_at({10.5, 33.125})));
  EXPECT_FALSE(same_images(one, lights_at({10.5, 33.126, 70.751})));
}

}  // namespace
}  // namespace crumple
