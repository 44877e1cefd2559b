#include "tracking/led_sighting.h"

#include <Eigen/LU>
#include <fmt/format.h>

namespace crumple {
namespace {

Expected<void> check_reading(const Rig& rig, const LedReading& reading) {
  const LedView& view = reading.view;
  if (view.sensor >= rig.sensors.size())
    return fail(fmt::format("LEDs seen by sensor {}, which the rig has not", view.sensor));
  const Sensor& sensor = rig.sensors[view.sensor];
  if (sensor.kind != SensorKind::camera || sensor.mount != Mount::world) {
    return fail(fmt::format("{} is no camera fixed to the world, so its LED pixels tell no pose", sensor.name));
  }
  if (view.pixels.size() != view.leds.size() || reading.covariances_px2.size() != view.leds.size()) {
    return fail(fmt::format("{}: LEDs, pixels and covariances have to be equally many", sensor.name));
  }
  for (std::size_t i = 0; i < view.leds.size(); ++i) {
    if (view.leds[i] >= rig.leds.size()) return fail(fmt::format("LED {}, which the rig has not", view.leds[i]));
    const Eigen::Matrix2d& c = reading.covariances_px2[i];
    if (!view.pixels[i].allFinite() || !c.allFinite() || !(c(0, 0) > 0 && c.determinant() > 0)) {
      return fail(fmt::format("{}: the pixel or the covariance of LED {} is not sound", sensor.name,
                              rig.leds[view.leds[i]].name));
    }
  }
  return {};
}

}  // namespace

Expected<std::vector<LedSighting>> led_sightings(const Rig& rig, const LedReadings& readings) {
  std::vector<LedSighting> sightings;
  for (const LedReading& reading : readings) {
    if (auto sound = check_reading(rig, reading); !sound) return tl::unexpected(sound.error());
    const Sensor& sensor = rig.sensors[reading.view.sensor];
    for (std::size_t i = 0; i < reading.view.leds.size(); ++i) {
      const std::size_t led = reading.view.leds[i];
      if (rig.leds[led].mount != Mount::probe) continue;
      sightings.push_back({reading.view.sensor, led, &sensor.lens, sensor.sensor_from_mount, rig.leds[led].position_mm,
                           reading.view.pixels[i], reading.covariances_px2[i], reading.covariances_px2[i].inverse()});
    }
  }
  return sightings;
}

bool evaluate(const LedSighting& sighting, const Pose& world_from_probe, SightingResidual& at) {
  thread_local std::vector<double> d_parameters;
  const auto count = static_cast<std::size_t>(sighting.lens->parameter_count());
  if (d_parameters.size() < 2 * count) d_parameters.resize(2 * count);
  const Eigen::Vector3d turned = world_from_probe.rotation * sighting.led_mm;
  const Eigen::Vector3d in_sensor = sighting.sensor_from_world * (turned + world_from_probe.translation);
  Eigen::Vector2d pixel;
  Matrix2x3d d_point;
  if (!sighting.lens->project_into(in_sensor, pixel, d_point, d_parameters.data(), d_parameters.data() + count)) {
    return false;
  }
  at.residual_px = pixel - sighting.pixel;
  const Matrix2x3d d_world = d_point * sighting.sensor_from_world.rotation.toRotationMatrix();
  at.d_pose.leftCols<3>() = -d_world * cross_matrix(turned);
  at.d_pose.rightCols<3>() = d_world;
  return true;
}

}  // namespace crumple
