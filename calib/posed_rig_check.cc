#include "calib/posed_rig_check.h"

#include <map>
#include <optional>
#include <set>

namespace crumple {
namespace {

struct PosedReading {
  std::size_t station = 0;  // of those that count
  std::size_t sensor = 0, led = 0;
  Eigen::Vector2d pixel;
};

std::vector<PosedReading> readings_of(const Rig& rig, const Constellation& where, std::size_t station) {
  std::vector<PosedReading> readings;
  for (const LedReading& reading : where.readings) {
    for (std::size_t i = 0; i < reading.view.leds.size(); ++i) {
      const std::size_t led = reading.view.leds[i];
      if (rig.leds[led].mount != Mount::probe) continue;
      readings.push_back({station, reading.view.sensor, led, reading.view.pixels[i]});
    }
  }
  return readings;
}

// Trackers that read anything, and those whose lens they share.
std::map<std::size_t, std::size_t> add_trackers(const Rig& rig, const std::vector<PosedReading>& readings,
                                                CalibrationData& data) {
  std::set<std::size_t> needed;
  for (const PosedReading& reading : readings) {
    needed.insert(reading.sensor);
    needed.insert(rig.sensors[reading.sensor].lens_of.value_or(reading.sensor));
  }
  std::map<std::size_t, std::size_t> numbers;
  for (const std::size_t s : needed) {
    const Sensor& sensor = rig.sensors[s];
    numbers[s] = data.sensors.size();
    std::optional<std::size_t> lens_of;
    if (sensor.lens_of) lens_of = numbers.at(*sensor.lens_of);
    data.sensors.push_back({sensor.name, sensor.kind, sensor.lens.size(), sensor.lens.model(), sensor.mount, lens_of});
  }
  return numbers;
}

}  // namespace

Expected<RigCheck> check_posed_rig(const Rig& rig, const std::vector<std::pair<std::string, Constellation>>& stations,
                                   int threads) {
  if (rig.covariance.names.empty()) return fail("the rig has no covariance, so nothing says what it may be off by");
  CalibrationData data;
  data.leds = rig.leds;
  std::vector<PosedReading> readings;
  for (const auto& [name, where] : stations) {
    if (where.pose.choice) continue;
    const std::vector<PosedReading> here = readings_of(rig, where, data.station_names.size());
    readings.insert(readings.end(), here.begin(), here.end());
    data.station_names.push_back(name);
  }
  if (data.station_names.empty()) return fail("at no station do the LEDs alone tell the pose");
  const std::map<std::size_t, std::size_t> numbers = add_trackers(rig, readings, data);
  for (const PosedReading& reading : readings) {
    std::vector<LedView>& views = data.observations.leds;
    const std::size_t sensor = numbers.at(reading.sensor);
    if (views.empty() || views.back().sensor != sensor || views.back().station != reading.station) {
      views.push_back({sensor, {}, {}, reading.station});
    }
    views.back().leds.push_back(reading.led);
    views.back().pixels.push_back(reading.pixel);
  }
  return check_rig(data, {.rig = rig}, threads);
}

std::vector<MisfittingStation> misfitting_stations(const Rig& rig,
                                                   const std::vector<std::pair<std::string, Constellation>>& stations,
                                                   const NoiseFactors& noisier) {
  constexpr double kFalseAlarm = 1e-3;
  std::vector<MisfittingStation> found;
  for (const auto& [name, where] : stations) {
    const auto misfit = pose_misfit(rig, used_readings(rig, where), where.pose.world_from_probe, noisier);
    if (!misfit || misfit->probability * static_cast<double>(stations.size()) > kFalseAlarm) continue;
    found.push_back({name, *misfit});
  }
  return found;
}

}  // namespace crumple
