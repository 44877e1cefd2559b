#include "cli/sensor_pairs.h"

#include <algorithm>

#include <fmt/format.h>

#include "cli/progress.h"

namespace crumple {
namespace {

Expected<const Sensor*> matching_sensor(const CaptureSensor& wanted, const Rig& rig, const std::string& rig_folder) {
  const auto index = rig.find(wanted.name);
  if (!index) return nullptr;
  const Sensor& sensor = rig.sensors[*index];
  const ImageSize size = sensor.lens.size();
  if (sensor.kind == wanted.kind && size == wanted.size) return &sensor;
  return fail(fmt::format("{}: sensor {} is a {} of {} x {} but the capture's is a {} of {} x {}: is it another rig?",
                          rig_folder, wanted.name, sensor.kind == SensorKind::camera ? "camera" : "projector",
                          size.width_px, size.height_px, wanted.kind == SensorKind::camera ? "camera" : "projector",
                          wanted.size.width_px, wanted.size.height_px));
}

// Projectors that show the patterns at some station.
std::vector<std::string> projectors_of(const Capture& capture) {
  std::vector<std::string> names;
  for (const Station& station : capture.stations) {
    const std::string& name = capture.projector_at(station.id);
    if (std::find(names.begin(), names.end(), name) == names.end()) names.push_back(name);
  }
  return names;
}

}  // namespace

Expected<std::vector<SensorPair>> sensor_pairs(const Capture& capture, const Rig& rig, const std::string& rig_folder) {
  if (!capture.projector || capture.orientations.empty()) {
    return fail(fmt::format("{} has no stripe frames: there is nothing to reconstruct", capture.description.string()));
  }
  std::vector<SensorPair> pairs;
  for (const CaptureSensor& wanted : capture.sensors) {
    if (wanted.kind != SensorKind::camera || !capture.sees_patterns(wanted.name)) continue;
    const auto camera = matching_sensor(wanted, rig, rig_folder);
    if (!camera) return tl::unexpected(camera.error());
    if (*camera == nullptr) {
      log_warning(fmt::format("camera {} is left out: {} does not know it", wanted.name, rig_folder));
      continue;
    }
    for (const std::string& name : projectors_of(capture)) {
      const auto projector = matching_sensor(*capture.sensor(name), rig, rig_folder);
      if (!projector) return tl::unexpected(projector.error());
      if (*projector == nullptr) return fail(fmt::format("{} has no sensor {}", rig_folder, name));
      pairs.push_back({wanted.name, name,
                       StationGeometry((*camera)->lens, (*projector)->lens, (*camera)->sensor_from_mount,
                                       (*projector)->sensor_from_mount)});
    }
  }
  if (pairs.empty()) return fail(fmt::format("{} knows none of the capture's cameras", rig_folder));
  return pairs;
}

}  // namespace crumple
