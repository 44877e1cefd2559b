#include "datasets/scene_sensors.h"

#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "datasets/scene_values.h"
#include "datasets/tracker_yaml.h"
#include "datasets/yaml_values.h"

namespace crumple {
namespace {

constexpr double kFurthestFocus_mm = 1e5;

Lens placeholder_lens() { return *Lens::undistorted("LENSMODEL_PINHOLE", {1, 1}, 1, 1, Eigen::Vector2d::Zero()); }

// The parameters by mrcal's order: focal lengths, centre, then the distortion; what is left out of that is zero.
Lens read_lens(const YamlValue& value, ImageSize size) {
  YamlMap map = value.map();
  std::string model = "LENSMODEL_OPENCV5";
  if (const auto given = map.find("model")) model = given->text();
  std::vector<double> parameters;
  const auto append = [&](const std::optional<YamlValue>& pair, double lowest) {
    const Eigen::Vector2d numbers = pair ? read_vector<2>(*pair, lowest, 1e6) : Eigen::Vector2d(1, 1);
    parameters.insert(parameters.end(), {numbers.x(), numbers.y()});
  };
  append(map.require("focal_px", "[along x, along y]"), 1);
  append(map.require("centre_px", "[x, y] of the principal point"), -1e6);
  if (const auto distortion = map.find("distortion")) {
    for (const YamlValue& item : distortion->list()) parameters.push_back(item.number(-100, 100));
  }
  map.finish();
  const auto lens = Lens::undistorted(model, size, parameters[0], parameters[1], {parameters[2], parameters[3]});
  if (!lens) {
    value.problem(lens.error().message);
    return placeholder_lens();
  }
  const auto count = static_cast<std::size_t>(lens->parameter_count());
  if (parameters.size() > count) {
    value.problem(fmt::format("{} takes at most {} distortion terms", model, count - 4));
    return placeholder_lens();
  }
  parameters.resize(count, 0.0);
  return lens->with_parameters(std::move(parameters));
}

Optics read_optics(YamlMap& map) {
  Optics optics;
  optics.blur_px = number_or(map, "blur_px", optics.blur_px, 0, 20);
  optics.aperture_mm = number_or(map, "aperture_mm", optics.aperture_mm, 0, 200);
  optics.focus_distance_mm = number_or(map, "focus_distance_mm", optics.focus_distance_mm, 1, kFurthestFocus_mm);
  return optics;
}

Detector read_detector(YamlMap& map) {
  Detector detector;
  detector.exposure = number_or(map, "exposure", detector.exposure, 1e-6, 1e3);
  detector.full_well_electrons = number_or(map, "full_well_electrons", detector.full_well_electrons, 1, 1e9);
  detector.read_noise_electrons = number_or(map, "read_noise_electrons", detector.read_noise_electrons, 0, 1e6);
  if (const auto shot = map.find("shot_noise")) detector.shot_noise = shot->boolean();
  if (const auto bits = map.find("bits")) detector.bits = bits->integer(8, 16);
  detector.offset = number_or(map, "offset", detector.offset, 0, 0.5);
  return detector;
}

Emitter read_emitter(YamlMap& map) {
  Emitter emitter;
  emitter.gamma = number_or(map, "gamma", emitter.gamma, 0.1, 10);
  emitter.black = number_or(map, "black", emitter.black, 0, 1);
  emitter.pixel_fill = number_or(map, "pixel_fill", emitter.pixel_fill, 0.1, 1);
  return emitter;
}

void read_scene_sensor(const std::string& name, const YamlValue& value, int schema, const std::string& showing,
                       Scene& scene) {
  if (!is_plain_name(name)) value.problem("a sensor's name is made of letters, digits, _ and -");
  YamlMap map = value.map();
  Sensor sensor{name, SensorKind::camera, placeholder_lens(), {}};
  if (const auto kind = map.require("kind", "camera or projector")) {
    if (kind->one_of({"camera", "projector"}) == "projector") sensor.kind = SensorKind::projector;
  }
  const ImageSize size = read_size_px(map);
  if (const auto lens = map.require("lens", "{focal_px: [x, y], centre_px: [x, y]}"))
    sensor.lens = read_lens(*lens, size);
  sensor.mount = read_mount(find_new_in_scene_2(map, "mount", schema));
  sensor.sensor_from_mount = read_place(map).inverse();
  const Optics optics = read_optics(map);
  if (sensor.kind == SensorKind::camera && sensor.mount == Mount::world) {
    scene.tracking.trackers.push_back({std::move(sensor), optics, read_detector(map)});
  } else if (sensor.mount == Mount::world) {
    value.problem("a projector is on the probe: leave out `mount: world`");
  } else if (sensor.kind == SensorKind::camera) {
    const auto sees = find_new_in_scene_2(map, "sees", schema);
    const bool thermal = sees && sees->one_of({"light", "thermal"}) == "thermal";
    scene.cameras.push_back({std::move(sensor), optics, read_detector(map), thermal});
  } else if (scene.projector && name != showing) {
    if (schema < 2) value.problem("a scene has one projector at most before crumple-scene/2");
    read_emitter(map);
    scene.dark_projectors.push_back(std::move(sensor));
  } else {
    if (scene.projector) scene.dark_projectors.push_back(scene.projector->sensor);
    scene.projector = SceneProjector{std::move(sensor), optics, read_emitter(map)};
  }
  map.finish();
}

bool is_placed(const std::vector<SceneCamera>& cameras) {
  if (cameras.empty()) return false;
  const Pose& first = cameras.front().sensor.sensor_from_mount;
  return !first.translation.isZero() || !rotation_vector(first.rotation).isZero();
}

}  // namespace

void read_scene_sensors(const YamlValue& value, int schema, const std::string& showing, Scene& scene) {
  YamlMap map = value.map();
  for (const auto& [name, sensor] : map.entries()) read_scene_sensor(name, sensor, schema, showing, scene);
  if (scene.cameras.empty() && scene.tracking.trackers.empty()) value.problem("at least one camera is needed");
  if (is_placed(scene.cameras))
    value.problem("the first camera's frame is the probe frame: leave out its position_mm and rotation_deg");
  if (is_placed(scene.tracking.trackers))
    value.problem(
        "the frame of the first camera with `mount: world` is the world frame: leave out its position_mm and "
        "rotation_deg");
}

}  // namespace crumple
