#include "datasets/scene_surfaces.h"

#include <numbers>

#include "datasets/scene_values.h"
#include "datasets/target_yaml.h"
#include "datasets/yaml_values.h"

namespace crumple {
namespace {

constexpr double degree = std::numbers::pi / 180;

// Stands in beside a problem: a plate cannot be made of nothing.
const Target kStandIn{2, 3, 1};

Crease read_crease(const YamlValue& value) {
  YamlMap map = value.map();
  Crease crease;
  if (const auto through = map.find("through_mm")) {
    crease.through_mm = read_vector<2>(*through, -kLargestScene_mm, kLargestScene_mm);
  }
  crease.direction_rad = degree * number_or(map, "direction_deg", 0, -360, 360);
  crease.angle_rad = degree * required_number(map, "angle_deg", "of the fold", -90, 90);
  crease.radius_mm = required_number(map, "radius_mm", "of the rounded edge", 0.5, kLargestScene_mm);
  map.finish();
  return crease;
}

Recess read_recess(const YamlValue& value) {
  YamlMap map = value.map();
  Recess recess;
  if (const auto centre = map.find("centre_mm"))
    recess.centre_mm = read_vector<2>(*centre, -kLargestScene_mm, kLargestScene_mm);
  if (const auto size = map.require("half_size_mm", "[along x, along y]")) {
    recess.half_size_mm = read_vector<2>(*size, 1, kLargestScene_mm);
  }
  recess.depth_mm = required_number(map, "depth_mm", "of the bowl", -1000, 1000);
  map.finish();
  return recess;
}

Dent read_dent(const YamlValue& value) {
  YamlMap map = value.map();
  Dent dent;
  if (const auto centre = map.find("centre_mm"))
    dent.centre_mm = read_vector<2>(*centre, -kLargestScene_mm, kLargestScene_mm);
  dent.radius_mm = required_number(map, "radius_mm", "of the dent, one sigma", 1, kLargestScene_mm);
  dent.depth_mm = required_number(map, "depth_mm", "of the dent, negative for a bump", -1000, 1000);
  map.finish();
  return dent;
}

}  // namespace

BoardPlate read_plate(const YamlValue& value) {
  YamlMap map = value.map();
  const Target target = read_target(map);
  Eigen::Vector2d warp_mm = Eigen::Vector2d::Zero();
  if (const auto warp = map.find("warp_mm")) warp_mm = read_vector<2>(*warp, -10, 10);
  const double margin = number_or(map, "margin_mm", target.pitch_mm / 2, 0, kLargestScene_mm);
  Material white{0.85, 0.02, 0.5};
  Material black{0.05, 0.02, 0.5};
  if (const auto material = map.find("white")) white = read_material(*material, white);
  if (const auto material = map.find("black")) black = read_material(*material, black);
  map.finish();
  if (const auto sound = checked(target); !sound) {
    value.problem(sound.error().message);
    return {kStandIn, warp_mm, margin, white, black};
  }
  return {target, warp_mm, margin, white, black};
}

Panel read_panel(const YamlValue& value) {
  YamlMap map = value.map();
  PanelShape shape;
  if (const auto size = map.require("size_mm", "[width, height]"))
    shape.size_mm = read_vector<2>(*size, 1, kLargestScene_mm);
  if (const auto radius = map.find("bulge_radius_mm")) {
    for (int axis = 0; axis < 2; ++axis) {
      const double r = read_vector<2>(*radius, -1e7, 1e7)[axis];
      if (std::abs(r) < 50) {
        radius->problem("must be two radii of 50 mm or more (negative: hollow)");
        break;
      }
      shape.curvature_per_mm[axis] = 1 / r;
    }
  }
  Material paint{0.4, 0.04, 0.3};
  if (const auto creases = map.find("creases")) {
    for (const YamlValue& item : creases->list()) shape.creases.push_back(read_crease(item));
  }
  if (const auto recesses = map.find("recesses")) {
    for (const YamlValue& item : recesses->list()) shape.recesses.push_back(read_recess(item));
  }
  if (const auto dents = map.find("dents")) {
    for (const YamlValue& item : dents->list()) shape.dents.push_back(read_dent(item));
  }
  if (const auto material = map.find("paint")) paint = read_material(*material, paint);
  map.finish();
  return {shape, paint};
}

}  // namespace crumple
