#include "datasets/render/led_spots.h"

#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <opencv2/core.hpp>

#include "datasets/render/render.h"
#include "datasets/render/sensor.h"
#include "tests/datasets/tracked_scene.h"

namespace crumple {
namespace {

using testing::ElementsAre;

Eigen::Vector2d centroid(const cv::Mat1f& image, const Eigen::Vector2d& near, int reach) {
  Eigen::Vector3d sums = Eigen::Vector3d::Zero();
  for (int y = static_cast<int>(near.y()) - reach; y <= static_cast<int>(near.y()) + reach + 1; ++y) {
    for (int x = static_cast<int>(near.x()) - reach; x <= static_cast<int>(near.x()) + reach + 1; ++x) {
      sums += static_cast<double>(image(y, x)) * Eigen::Vector3d(x, y, 1);
    }
  }
  return sums.head<2>() / sums.z();
}

std::vector<std::size_t> leds_of(const std::vector<LedSpot>& spots) {
  std::vector<std::size_t> leds;
  for (const LedSpot& spot : spots) {
    if (spot.led) leds.push_back(*spot.led);
  }
  return leds;
}

TEST(LedSpots, lie_where_the_measurement_model_says) {
  const Scene scene = tracked_scene();
  const Observations ideal = ideal_observations(scene, 40);
  ASSERT_EQ(ideal.leds.size(), 6U);
  for (const LedView& view : ideal.leds) {
    ASSERT_EQ(view.leds.size(), 4U);
    for (std::size_t frame = 1; frame < scene.tracking.frames.size(); ++frame) {
      for (const LedSpot& spot : spots_seen(scene, *view.station, view.sensor - 2, frame, {})) {
        EXPECT_LT((spot.centre_px - view.pixels[*spot.led]).norm(), 1e-9);
      }
    }
  }
}

TEST(LedSpots, follow_the_words) {
  Scene scene = tracked_scene();
  EXPECT_THAT(leds_of(spots_seen(scene, 0, 0, 0, {})), ElementsAre());
  EXPECT_THAT(leds_of(spots_seen(scene, 0, 0, 1, {})), ElementsAre(1, 2));
  EXPECT_THAT(leds_of(spots_seen(scene, 0, 0, 2, {})), ElementsAre(0, 1, 3));
  scene.tracking.blink_start = 15;  // the last step of eight
  EXPECT_THAT(leds_of(spots_seen(scene, 0, 0, 2, {})), ElementsAre(1, 2));
}

// Pixels are integrals over a Gaussian: the centroid is the centre, whatever the place within the pixel.
TEST(LedSpots, have_their_light_and_their_centre) {
  for (const double offset : {0.0, 0.17, 0.5, 0.83}) {
    const LedSpot spot{Eigen::Vector2d(20 + offset, 18 - offset), 0.8, 3, 0};
    cv::Mat1f image(40, 40, 0.0F);
    draw_spots({spot}, 2, image);
    EXPECT_NEAR(cv::sum(image)[0], 1.5, 1e-4);
    EXPECT_LT((centroid(image, spot.centre_px, 8) - spot.centre_px).norm(), 1e-4);
  }
  cv::Mat1f edge(40, 40, 0.0F);
  draw_spots({{Eigen::Vector2d(-0.5, 39.5), 0.8, 1, 0}, {Eigen::Vector2d(-50, 400), 0.8, 1, 0}}, 1, edge);
  EXPECT_NEAR(cv::sum(edge)[0], 0.25, 1e-4);
}

TEST(LedSpots, in_rendered_images_are_centred_to_the_noise) {
  const Scene scene = tracked_scene();
  const Renderer renderer(scene, 2);
  const LedView ideal = ideal_observations(scene, 40).leds[0];
  std::vector<cv::Mat> images(scene.tracking.frames.size());
  ASSERT_TRUE(renderer.render_trackers(0, [&](const RenderedFrame& frame) -> Expected<void> {
    if (frame.camera == 0) images[frame.frame] = frame.image;
    return {};
  }));
  const Detector& detector = scene.tracking.trackers[0].detector;
  for (const LedSpot& spot : spots_seen(scene, 0, 0, 2, {})) {
    cv::Mat1f image;
    images[2].convertTo(image, CV_32F);
    cv::Mat1f dark;
    images[4].convertTo(dark, CV_32F);
    // The LED is dark in the other image, so that the background falls out.
    const std::string& word = scene.tracking.leds[*spot.led].word;
    if (word[3] == '1') continue;
    cv::Mat1f difference;
    cv::subtract(image, dark, difference);
    const Eigen::Vector2d measured = centroid(difference, spot.centre_px, 3);
    const double electrons = spot.light * detector.full_well_electrons;
    // Shot noise of the spot, the background's and the codes' over 7 x 7 pixels of two images.
    const double background = 49 * 2 * (64 + 400 + std::pow(10000 / 255.0, 2) / 12) * 4;
    const double sigma = std::sqrt(0.9 * 0.9 * electrons + background) / electrons;
    EXPECT_LT((measured - ideal.pixels[*spot.led]).norm(), 4 * sigma) << sigma;
    EXPECT_LT(sigma, 0.1);
  }
}

TEST(LedSpots, the_body_hides_what_is_behind_it) {
  Scene scene = tracked_scene();
  scene.tracking.probe_body = Box{Pose{{}, {0, 50, -130}}, {30, 30, 20}};
  scene.tracking.probe_body->mount_from_box.rotation.setIdentity();
  EXPECT_THAT(leds_of(spots_seen(scene, 3, 0, 1, {})), ElementsAre(1));
  scene.tracking.probe_body->mount_from_box.translation.z() = 300;
  EXPECT_THAT(leds_of(spots_seen(scene, 3, 0, 1, {})), ElementsAre(1, 2));
}

TEST(LedSpots, a_surface_hides_what_is_behind_it) {
  const Scene scene = tracked_scene();
  const Tracer tracer(*scene.board);
  Pose before = world_from_surface(scene.stations[0]);
  EXPECT_THAT(leds_of(spots_seen(scene, 0, 0, 1, Obstacle{&tracer, before.inverse()})), ElementsAre(1, 2));
  before.translation.z() = 700;
  EXPECT_THAT(leds_of(spots_seen(scene, 0, 0, 1, Obstacle{&tracer, before.inverse()})), ElementsAre());
}

TEST(LedSpots, mirrors_and_lamps_make_false_ones) {
  Scene scene = tracked_scene();
  scene.tracking.lamps = {{{100, 0, 2000}, 30}};
  scene.tracking.mirrors = {{{-200, 0, 450}, Eigen::Vector3d::UnitX(), 300, 0.4}};
  const std::vector<LedSpot> spots = spots_seen(scene, 0, 0, 1, {});
  ASSERT_EQ(spots.size(), 5U);  // two LEDs, each followed by its reflection, and the lamp
  EXPECT_FALSE(spots[1].led);
  Eigen::Vector3d image = scene.stations[0].world_from_probe * scene.tracking.leds[1].led.position_mm;
  image.x() = -400 - image.x();
  const Sensor& tracker = scene.tracking.trackers[0].sensor;
  EXPECT_LT((spots[1].centre_px - *tracker.lens.project(image)).norm(), 1e-9);
  EXPECT_LT(spots[1].light, 0.4 * spots[0].light);
  EXPECT_FALSE(spots[4].led);
  // Behind the mirror nothing is reflected.
  scene.tracking.mirrors[0].normal *= -1;
  EXPECT_EQ(spots_seen(scene, 0, 0, 1, {}).size(), 3U);
}

TEST(LedSpots, chance_is_seeded) {
  Scene scene = tracked_scene();
  scene.tracking.led_dropout = 0.3;
  scene.tracking.missing_frames = 0.3;
  std::size_t lit = 0;
  std::size_t missing = 0;
  for (std::size_t station = 0; station < 3; ++station) {
    for (std::size_t tracker = 0; tracker < 2; ++tracker) {
      EXPECT_FALSE(is_missing(scene, station, tracker, 0));
      for (std::size_t frame = 1; frame < 9; ++frame) {
        lit += spots_seen(scene, station, tracker, frame, {}).size();
        missing += is_missing(scene, station, tracker, frame) ? 1 : 0;
        EXPECT_EQ(leds_of(spots_seen(scene, station, tracker, frame, {})),
                  leds_of(spots_seen(scene, station, tracker, frame, {})));
      }
    }
  }
  const double ones = 6 * (4 + 4 + 4 + 5);
  EXPECT_NEAR(static_cast<double>(lit), 0.7 * ones, 3 * std::sqrt(0.21 * ones));
  EXPECT_NEAR(static_cast<double>(missing), 0.3 * 48, 3 * std::sqrt(0.21 * 48));
}

}  // namespace
}  // namespace crumple
