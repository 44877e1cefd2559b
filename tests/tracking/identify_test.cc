#include "tracking/identify.h"

#include <algorithm>
#include <string>

#include <Eigen/LU>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/tracking/made_spots.h"
#include "tests/tracking/made_station.h"
#include "tracking/constellation.h"
#include "tracking/stillness.h"

namespace crumple {
namespace {

using testing::HasSubstr;
using Frames = std::vector<std::optional<std::vector<Spot>>>;

struct MadeLight {
  Eigen::Vector2d pixel;
  std::optional<std::size_t> word;  // none: always on
};

constexpr double kSigma_px = 0.03;

Frames made_frames(const BlinkCode& code, const std::vector<MadeLight>& lights, int phase, int count,
                   std::mt19937& random) {
  std::normal_distribution<double> noise(0, kSigma_px);
  Frames frames;
  for (int k = 0; k < count; ++k) {
    frames.emplace_back(std::vector<Spot>());
    for (const MadeLight& light : lights) {
      if (light.word && !code.lit(*light.word, k + phase)) continue;
      Spot spot;
      spot.pixel = light.pixel + Eigen::Vector2d(noise(random), noise(random));
      spot.centre_of_gravity_px = spot.pixel;
      spot.covariance_px2 *= kSigma_px * kSigma_px;
      frames.back()->push_back(spot);
    }
  }
  return frames;
}

TEST(Identify, LedsAreToldAndAveraged) {
  const BlinkCode code = BlinkCode::generate(6, 18).value();
  std::mt19937 random(2);
  std::vector<MadeLight> lights;
  for (std::size_t led = 0; led < 6; ++led) lights.push_back({{100.0 + 50 * double(led), 300.4}, led});
  int inside = 0;
  for (int trial = 0; trial < 100; ++trial) {
    Frames frames = made_frames(code, lights, trial % 18, 36, random);
    for (int gone = 0; gone < 8; ++gone) frames[random() % 36].reset();
    const auto found = identify_leds(code, frames, {.lasting_sigma_px = 1e-6});
    ASSERT_TRUE(found) << found.error().message;
    ASSERT_EQ(found->leds.size(), 6u);
    EXPECT_EQ(found->start_phase, trial % 18);
    EXPECT_TRUE(found->candidates.empty());
    for (const IdentifiedLight& told : found->leds) {
      const Eigen::Vector2d error = told.light.pixel - lights[told.led].pixel;
      EXPECT_LT(error.norm(), 0.05);
      inside += error.dot(told.light.covariance_px2.inverse() * error) < 5.991;
    }
  }
  EXPECT_NEAR(inside / 600.0, 0.955, 0.025);
}

TEST(Identify, FalseLightsAreNamed) {
  const BlinkCode code = BlinkCode::generate(4, 18).value();
  std::mt19937 random(3);
  const std::vector<MadeLight> lights{{{100, 100}, 0}, {{200, 100}, 1},  {{300, 100}, 2},
                                      {{400, 100}, 3}, {{500, 400}, {}}, {{250, 500}, 2}};
  Frames frames = made_frames(code, lights, 7, 36, random);
  Spot stray;
  stray.pixel = {700, 20};
  frames[11]->push_back(stray);
  const Identification found = identify_leds(code, frames).value();
  std::vector<std::size_t> told, doubted;
  for (const IdentifiedLight& light : found.leds) told.push_back(light.led);
  for (const IdentifiedLight& light : found.candidates) doubted.push_back(light.led);
  EXPECT_THAT(told, testing::ElementsAre(0, 1, 3));
  EXPECT_THAT(doubted, testing::ElementsAre(2, 2));
  ASSERT_EQ(found.refused.size(), 2u);
  for (const UnidentifiedLight& refused : found.refused) {
    EXPECT_THAT(refused.reason, HasSubstr(refused.light.spots > 1 ? "lamp" : "no word"));
  }
}

TEST(Identify, LightsTooNearToEachOtherAreRefused) {
  const BlinkCode code = BlinkCode::generate(4, 18).value();
  std::mt19937 random(3);
  const Frames frames =
      made_frames(code, {{{100, 100}, 0}, {{101.5, 100}, 1}, {{300, 100}, 2}, {{400, 100}, 3}}, 0, 36, random);
  const Identification found = identify_leds(code, frames).value();
  EXPECT_GE(found.leds.size(), 2u);
  for (const IdentifiedLight& told : found.leds) EXPECT_GE(told.led, 2u);
}

TEST(Identify, RefusesInWords) {
  const BlinkCode code = BlinkCode::generate(4, 18).value();
  EXPECT_THAT(identify_leds(code, Frames(10)).error().message, HasSubstr("at least one whole word"));
  EXPECT_THAT(identify_leds(code, Frames(18)).error().message, HasSubstr("every frame"));
}

// The whole way: images with spots, some of them saturated, a lamp and the reflection of an LED, to a pose.
TEST(Constellation, FromImagesToAPoseThatPicksTheLedFromItsReflection) {
  const BlinkCode code = BlinkCode::generate(6, 18).value();
  MadeStation station = make_station({.leds = 6, .trackers = 2});
  std::mt19937 random(12);
  const std::vector<std::size_t> led_of_word{3, 0, 1, 2, 5, 4};
  const Eigen::Vector2d corner(700, 500);  // of the part of the image that is drawn
  std::vector<TrackerLights> trackers;
  for (const LedReading& reading : station.readings) {
    Frames frames;
    for (int k = 0; k < 36; ++k) {
      if (k % 5 == 2) {
        frames.emplace_back();
        continue;
      }
      std::vector<SpotModel> spots{made_spot(600, 30, 1.4, 150)};
      for (std::size_t word = 0; word < 6; ++word) {
        if (!code.lit(word, k + 4)) continue;
        const Eigen::Vector2d at = reading.view.pixels[led_of_word[word]] - corner;
        spots.push_back(made_spot(at.x(), at.y(), 1.3, 120 + 60 * double(word)));
        if (word == 1) spots.push_back(made_spot(120.6, 500.2, 1.3, 90));
      }
      frames.push_back(find_spots(made_spot_image(spots, {.width_px = 680, .height_px = 560}, random))->spots);
    }
    Identification lights = identify_leds(code, frames).value();
    EXPECT_EQ(lights.leds.size(), 5u);
    EXPECT_EQ(lights.candidates.size(), 2u);
    for (auto* told : {&lights.leds, &lights.candidates}) {
      for (IdentifiedLight& light : *told) light.light.pixel += corner;
    }
    trackers.push_back({reading.view.sensor, lights});
  }
  const auto settled = settle_constellation(station.rig, trackers, led_of_word);
  ASSERT_TRUE(settled) << settled.error().message;
  EXPECT_EQ(settled->pose.redundancy, 2 * 12 - 6);
  const Vector6d step = local_step(station.world_from_probe, settled->pose.world_from_probe);
  EXPECT_LT(step.dot(settled->pose.covariance.inverse() * step), 25);
  EXPECT_EQ(std::count_if(settled->refused.begin(), settled->refused.end(),
                          [](const RefusedLight& r) {
                            return r.reason.find("reflection") != std::string::npos &&
                                   r.reason.find("led0") != std::string::npos;
                          }),
            2);
}

// Words of 18 frames read twice; in between one tracker is pushed by a tenth of a pixel, or nothing happens.
TEST(Identify, RepetitionsTellWhatMovedBetweenThem) {
  const BlinkCode code = BlinkCode::generate(6, 18).value();
  std::mt19937 random(5);
  std::vector<MadeLight> lights;
  for (std::size_t led = 0; led < 6; ++led) lights.push_back({{100.0 + 50 * double(led), 300.4}, led});
  for (const double push_px : {0.0, 0.1}) {
    int moved = 0;
    for (int trial = 0; trial < 50; ++trial) {
      Frames frames = made_frames(code, lights, 3, 36, random);
      for (std::size_t k = 18; k < 36; ++k) {
        for (Spot& spot : *frames[k]) spot.pixel.x() += push_px;
      }
      const auto found = identify_leds(code, frames, {.lasting_sigma_px = 1e-6});
      ASSERT_TRUE(found) << found.error().message;
      ASSERT_EQ(found->leds.size(), 6u);
      const auto times = readings_over_time({{0, *found}}, {0, 1, 2, 3, 4, 5});
      ASSERT_EQ(times.size(), 2u);
      const Stillness result = stillness(times);
      EXPECT_EQ(result.degrees, 12);
      moved += !result.still;
    }
    EXPECT_LE(moved, push_px > 0 ? 50 : 1);
    EXPECT_GE(moved, push_px > 0 ? 50 : 0);
  }
}

}  // namespace
}  // namespace crumple
