#include "datasets/scene_values.h"

#include <numbers>

#include "datasets/yaml_values.h"

namespace crumple {
namespace {

constexpr double kFurthestPosition_mm = 1e5;

}  // namespace

std::optional<YamlValue> find_new_in_scene_2(YamlMap& map, const std::string& key, int schema) {
  auto value = map.find(key);
  if (value && schema < 2) value->problem("is new in crumple-scene/2: write `schema: crumple-scene/2`");
  return value;
}

Pose read_place(YamlMap& map) {
  Pose pose;
  if (const auto position = map.find("position_mm")) {
    pose.translation = read_vector<3>(*position, -kFurthestPosition_mm, kFurthestPosition_mm);
  }
  if (const auto rotation = map.find("rotation_deg")) {
    pose.rotation = rotation_from_vector(read_vector<3>(*rotation, -360, 360) * std::numbers::pi / 180);
  }
  return pose;
}

Material read_material(const YamlValue& value, const Material& otherwise) {
  YamlMap map = value.map();
  Material material;
  material.albedo = number_or(map, "albedo", otherwise.albedo, 0, 1);
  material.gloss = number_or(map, "gloss", otherwise.gloss, 0, 1);
  material.roughness = number_or(map, "roughness", otherwise.roughness, 0.02, 1);
  material.thermal = number_or(map, "thermal", otherwise.thermal, 0, 100);
  map.finish();
  return material;
}

}  // namespace crumple
