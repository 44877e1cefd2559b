#include "datasets/scene_surfaces.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <string>
#include <vector>

#include <fmt/format.h>

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

Press read_press(const YamlValue& value) {
  YamlMap map = value.map();
  Press press;
  if (const auto centre = map.find("centre_mm")) {
    press.centre_mm = read_vector<2>(*centre, -kLargestScene_mm, kLargestScene_mm);
  }
  press.direction_rad = degree * number_or(map, "direction_deg", 0, -360, 360);
  press.half_length_mm = required_number(map, "half_length_mm", "along the line", 1, kLargestScene_mm);
  press.half_width_mm = required_number(map, "half_width_mm", "across the line", 1, kLargestScene_mm);
  press.depth_mm = required_number(map, "depth_mm", "in the middle", -1000, 1000);
  press.edge_radius_mm = number_or(map, "edge_radius_mm", 0, 0, kLargestScene_mm);
  if (press.edge_radius_mm > 0 && press.edge_radius_mm < 0.5) map.problem("`edge_radius_mm` is 0, or 0.5 or more");
  map.finish();
  return press;
}

// Adds what is listed to a shape that may have such things already.
void read_features(YamlMap& map, PanelShape& shape) {
  const auto add = [&](const char* key, auto& list, auto read) {
    const auto items = map.find(key);
    if (!items) return;
    for (const YamlValue& item : items->list()) list.push_back(read(item));
  };
  add("creases", shape.creases, read_crease);
  add("recesses", shape.recesses, read_recess);
  add("dents", shape.dents, read_dent);
  add("presses", shape.presses, read_press);
}

const Material kPaint{0.4, 0.04, 0.3};

Panel read_panel_keys(YamlMap& map) {
  PanelShape shape;
  if (const auto size = map.require("size_mm", "[width, height]")) {
    shape.size_mm = read_vector<2>(*size, 1, kLargestScene_mm);
  }
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
  read_features(map, shape);
  Material paint = kPaint;
  if (const auto material = map.find("paint")) paint = read_material(*material, paint);
  return {shape, paint};
}

Panel read_car_side(YamlMap& map) {
  Eigen::Vector2d size_mm(4000, 1200);
  if (const auto size = map.find("size_mm")) size_mm = read_vector<2>(*size, 300, kLargestScene_mm);
  PanelShape shape = car_side(size_mm);
  read_features(map, shape);
  Material paint = kPaint;
  if (const auto material = map.find("paint")) paint = read_material(*material, paint);
  return {shape, paint};
}

Panel read_flat_plate(YamlMap& map) {
  PanelShape shape;
  if (const auto size = map.require("size_mm", "[width, height]")) {
    shape.size_mm = read_vector<2>(*size, 1, kLargestScene_mm);
  }
  Material finish{0.7, 0, 0.5};
  if (const auto material = map.find("finish")) finish = read_material(*material, finish);
  return {shape, finish};
}

Balls read_balls(YamlMap& map) {
  const double radius = required_number(map, "radius_mm", "of each ball", 1, kLargestScene_mm);
  std::vector<Eigen::Vector2d> centres;
  if (const auto list = map.find("centres_mm")) {
    for (const YamlValue& item : list->list()) {
      const Eigen::Vector2d centre = read_vector<2>(item, -kLargestScene_mm, kLargestScene_mm);
      const bool overlaps = std::any_of(centres.begin(), centres.end(), [&](const Eigen::Vector2d& other) {
        return (other - centre).norm() < 2 * radius;
      });
      if (overlaps) item.problem("overlaps another ball");
      centres.push_back(centre);
    }
  }
  if (centres.empty()) centres.emplace_back(0, 0);
  Material finish{0.7, 0, 0.5};
  if (const auto material = map.find("finish")) finish = read_material(*material, finish);
  return {radius, centres, finish};
}

// `like: NAME` repeats an earlier panel or car side, with what is listed beside it added: before and after a crash.
std::shared_ptr<const Surface> read_like(const YamlValue& like, YamlMap& map, const std::vector<SceneObject>& earlier) {
  const std::string name = like.text();
  const auto found = std::find_if(earlier.begin(), earlier.end(), [&](const SceneObject& o) { return o.name == name; });
  const Panel* panel = found == earlier.end() ? nullptr : dynamic_cast<const Panel*>(found->surface.get());
  if (panel == nullptr) {
    like.problem(fmt::format("no panel or car side `{}` is described before this", name));
    return std::make_shared<Panel>(PanelShape{}, kPaint);
  }
  PanelShape shape = panel->shape();
  read_features(map, shape);
  return std::make_shared<Panel>(shape, panel->material(0, 0));
}

std::shared_ptr<const Surface> read_object(const YamlValue& value, const std::vector<SceneObject>& earlier) {
  YamlMap map = value.map();
  const auto like = map.find("like");
  const auto kind = like ? std::nullopt : map.require("kind", "panel, car_side, plate or balls");
  std::shared_ptr<const Surface> surface;
  if (like) {
    surface = read_like(*like, map, earlier);
  } else {
    const std::string word = kind ? kind->one_of({"panel", "car_side", "plate", "balls"}) : "car_side";
    if (word == "panel") surface = std::make_shared<Panel>(read_panel_keys(map));
    if (word == "car_side") surface = std::make_shared<Panel>(read_car_side(map));
    if (word == "plate") surface = std::make_shared<Panel>(read_flat_plate(map));
    if (word == "balls") surface = std::make_shared<Balls>(read_balls(map));
  }
  map.finish();
  return surface;
}

}  // namespace

BoardPlate read_plate(const YamlValue& value) {
  YamlMap map = value.map();
  const Target target = read_target(map);
  Eigen::Vector2d warp_mm = Eigen::Vector2d::Zero();
  if (const auto warp = map.find("warp_mm")) warp_mm = read_vector<2>(*warp, -10, 10);
  const double margin = number_or(map, "margin_mm", target.pitch_mm / 2, 0, kLargestScene_mm);
  Material white{0.85, 0.02, 0.5, 0.8};
  Material black{0.05, 0.02, 0.5, 0.45};
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
  Panel panel = read_panel_keys(map);
  map.finish();
  return panel;
}

std::vector<SceneObject> read_objects(const YamlValue& value) {
  std::vector<SceneObject> objects;
  YamlMap map = value.map();
  for (const auto& [name, object] : map.entries()) objects.push_back({name, read_object(object, objects)});
  return objects;
}

}  // namespace crumple
