#include "datasets/scene_tracking.h"

#include <string>
#include <vector>

#include <fmt/format.h>

#include "datasets/scene_values.h"
#include "datasets/tracker_yaml.h"
#include "datasets/yaml_values.h"

namespace crumple {
namespace {

constexpr double kFurthestLight_mm = 1e5;
constexpr double kBrightest = 1e6;

Eigen::Vector3d read_point(YamlMap& map, const std::string& key, const std::string& what) {
  const auto value = map.require(key, what);
  return value ? read_vector<3>(*value, -kFurthestLight_mm, kFurthestLight_mm) : Eigen::Vector3d::Zero();
}

SceneLed read_scene_led(const std::string& name, const YamlValue& value) {
  if (!is_plain_name(name)) value.problem("an LED's name is made of letters, digits, _ and -");
  YamlMap map = value.map();
  SceneLed led;
  led.led.name = name;
  led.led.position_mm = read_point(map, "position_mm", "[x, y, z] in its mount's frame");
  led.led.mount = read_mount(map.find("mount"));
  if (const auto word = map.require("word", "when it is lit, such as \"0110\"")) led.word = read_word(*word);
  led.brightness = number_or(map, "brightness", led.brightness, 0, kBrightest);
  if (const auto nominal = map.find("nominal_mm")) {
    led.nominal_mm = read_vector<3>(*nominal, -kFurthestLight_mm, kFurthestLight_mm);
  }
  map.finish();
  return led;
}

void read_scene_leds(const YamlValue& value, Tracking& tracking) {
  std::vector<std::string> words;
  YamlMap map = value.map();
  for (const auto& [name, led] : map.entries()) {
    tracking.leds.push_back(read_scene_led(name, led));
    words.push_back(tracking.leds.back().word);
    const bool hidden = tracking.probe_body && tracking.leds.back().led.mount == Mount::probe &&
                        contains(*tracking.probe_body, tracking.leds.back().led.position_mm);
    if (hidden) led.problem("lies inside `probe_body`");
  }
  check_words(words, value);
}

Lamp read_lamp(const YamlValue& value) {
  YamlMap map = value.map();
  Lamp lamp;
  lamp.position_mm = read_point(map, "position_mm", "[x, y, z] in the world");
  lamp.brightness = number_or(map, "brightness", lamp.brightness, 0, kBrightest);
  map.finish();
  return lamp;
}

Mirror read_mirror(const YamlValue& value) {
  YamlMap map = value.map();
  Mirror mirror;
  mirror.centre_mm = read_point(map, "centre_mm", "[x, y, z] in the world");
  const Eigen::Vector3d normal = read_point(map, "normal", "[x, y, z], to the side that reflects");
  if (normal.norm() < 1e-6) {
    map.problem("`normal` has no direction");
  } else {
    mirror.normal = normal.normalized();
  }
  mirror.radius_mm = number_or(map, "radius_mm", mirror.radius_mm, 1, kLargestScene_mm);
  mirror.reflectance = number_or(map, "reflectance", mirror.reflectance, 0, 1);
  map.finish();
  return mirror;
}

void read_false_spots(const YamlValue& value, Tracking& tracking) {
  for (const YamlValue& item : value.list()) {
    YamlMap map = item.map();
    const auto lamp = map.find("lamp");
    const auto mirror = map.find("mirror");
    if (lamp.has_value() == mirror.has_value()) map.problem("must be either a `lamp` or a `mirror`");
    if (lamp) tracking.lamps.push_back(read_lamp(*lamp));
    if (mirror) tracking.mirrors.push_back(read_mirror(*mirror));
    map.finish();
  }
}

Box read_box(const YamlValue& value) {
  YamlMap map = value.map();
  Box box;
  box.mount_from_box = read_place(map);
  if (const auto size = map.require("size_mm", "[x, y, z] along its axes")) {
    box.size_mm = read_vector<3>(*size, 0.1, kLargestScene_mm);
  }
  map.finish();
  return box;
}

}  // namespace

void read_scene_tracking(YamlMap& map, int schema, Scene& scene) {
  Tracking& tracking = scene.tracking;
  if (const auto body = find_new_in_scene_2(map, "probe_body", schema)) tracking.probe_body = read_box(*body);
  const auto leds = find_new_in_scene_2(map, "leds", schema);
  if (leds) read_scene_leds(*leds, tracking);
  const auto frames = find_new_in_scene_2(map, "tracker_frames", schema);
  if (frames) tracking.frames = read_tracker_frames(*frames);
  if (const auto spots = find_new_in_scene_2(map, "false_spots", schema)) read_false_spots(*spots, tracking);
  if (const auto start = find_new_in_scene_2(map, "blink_start", schema)) {
    tracking.blink_start = static_cast<std::size_t>(start->integer(0, 1000));
  }
  if (const auto share = find_new_in_scene_2(map, "led_exposure", schema))
    tracking.led_exposure = share->number(1e-6, 1);
  if (const auto chance = find_new_in_scene_2(map, "led_dropout", schema)) tracking.led_dropout = chance->number(0, 1);
  if (const auto chance = find_new_in_scene_2(map, "missing_frames", schema)) {
    tracking.missing_frames = chance->number(0, 1);
  }
  if (tracking.trackers.empty()) {
    for (const auto& value : {leds, frames}) {
      if (value) value->problem("needs a camera with `mount: world`");
    }
  } else if (!frames) {
    map.problem("`tracker_frames` is missing: what each image of the cameras with `mount: world` shows, in order");
  }
}

}  // namespace crumple
