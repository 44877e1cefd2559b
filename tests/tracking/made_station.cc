#include "tests/tracking/made_station.h"

#include <cmath>

#include <Eigen/Cholesky>

namespace crumple {
namespace {

// On a circle of 150 mm, every other one 60 mm in front of the rest.
Eigen::Vector3d led_place(int led, const MadeStationOptions& options) {
  const double angle = 2 * M_PI * led / options.leds + 0.1 * led * led;
  const double depth = options.flat ? 0 : (led % 2 == 0 ? -60 : 0) - 7 * led;
  return {150 * std::cos(angle), 110 * std::sin(angle), depth};
}

Pose tracker_from_world(int tracker, int trackers) {
  const double x_mm = 1000 * (tracker - (trackers - 1) / 2.0), angle = std::atan2(x_mm, 3000);
  const Eigen::Quaterniond turn = rotation_from_vector({0, angle, 0});
  return {turn, -(turn * Eigen::Vector3d(x_mm, 60 * tracker, 0))};
}

}  // namespace

MadeStation make_station(const MadeStationOptions& options, double turn_rad) {
  MadeStation station;
  const Lens lens =
      Lens::create("LENSMODEL_OPENCV5", {2048, 1536}, {2400, 2400, 1023.5, 767.5, -0.08, 0.04, 1e-4, -1e-4, 0}).value();
  station.rig.sensors.push_back({"cam0", SensorKind::camera, lens, {}, Mount::probe});
  for (int i = 0; i < options.trackers; ++i) {
    station.rig.sensors.push_back({"tracker" + std::to_string(i), SensorKind::camera, lens,
                                   tracker_from_world(i, options.trackers), Mount::world});
  }
  for (int i = 0; i < options.leds; ++i) {
    station.rig.leds.push_back({"led" + std::to_string(i), led_place(i, options), Mount::probe});
  }
  station.world_from_probe = {rotation_from_vector({0.1, turn_rad, -0.05}), {40, -30, options.distance_mm}};
  for (std::size_t s = 1; s < station.rig.sensors.size(); ++s) {
    const Sensor& sensor = station.rig.sensors[s];
    LedReading reading{.view = {.sensor = s, .leds = {}, .pixels = {}}, .covariances_px2 = {}};
    for (std::size_t led = 0; led < station.rig.leds.size(); ++led) {
      const Eigen::Vector3d in_world = station.world_from_probe * station.rig.leds[led].position_mm;
      reading.view.leds.push_back(led);
      reading.view.pixels.push_back(lens.project(sensor.sensor_from_mount * in_world).value());
      reading.covariances_px2.push_back(options.sigma_px * options.sigma_px * Eigen::Matrix2d::Identity());
    }
    station.readings.push_back(reading);
  }
  return station;
}

LedReadings with_noise(const LedReadings& readings, std::mt19937& random) {
  std::normal_distribution<double> normal(0, 1);
  LedReadings noisy = readings;
  for (LedReading& reading : noisy) {
    for (std::size_t i = 0; i < reading.view.pixels.size(); ++i) {
      const Eigen::Vector2d z(normal(random), normal(random));
      reading.view.pixels[i] += reading.covariances_px2[i].llt().matrixL() * z;
    }
  }
  return noisy;
}

}  // namespace crumple
