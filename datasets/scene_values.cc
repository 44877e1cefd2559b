#include "datasets/scene_values.h"

#include <numbers>

#include <fmt/format.h>

namespace crumple {
namespace {

constexpr int largest_side_px = 16384;
constexpr double furthest_mm = 1e5;

}  // namespace

double number_or(YamlMap& map, const std::string& key, double otherwise, double lowest, double highest) {
  const auto value = map.find(key);
  return value ? value->number(lowest, highest) : otherwise;
}

double required_number(YamlMap& map, const std::string& key, const std::string& what, double lowest, double highest) {
  const auto value = map.require(key, what);
  return value ? value->number(lowest, highest) : lowest;
}

template <int N>
Eigen::Matrix<double, N, 1> read_vector(const YamlValue& value, double lowest, double highest) {
  Eigen::Matrix<double, N, 1> numbers = Eigen::Matrix<double, N, 1>::Zero();
  const std::vector<YamlValue> items = value.list();
  if (items.size() != N) {
    value.problem(fmt::format("must hold {} numbers", N));
    return numbers;
  }
  for (int i = 0; i < N; ++i) numbers[i] = items[static_cast<std::size_t>(i)].number(lowest, highest);
  return numbers;
}

template Eigen::Vector2d read_vector<2>(const YamlValue&, double, double);
template Eigen::Vector3d read_vector<3>(const YamlValue&, double, double);

ImageSize read_size_px(YamlMap& map) {
  const auto size = map.require("size_px", "[width, height]");
  const std::vector<YamlValue> items = size ? size->list() : std::vector<YamlValue>{};
  if (items.size() != 2) {
    if (size) size->problem("must hold two numbers, [width, height]");
    return {1, 1};
  }
  return {items[0].integer(1, largest_side_px), items[1].integer(1, largest_side_px)};
}

Pose read_place(YamlMap& map) {
  Pose pose;
  if (const auto position = map.find("position_mm")) {
    pose.translation = read_vector<3>(*position, -furthest_mm, furthest_mm);
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
  map.finish();
  return material;
}

}  // namespace crumple
