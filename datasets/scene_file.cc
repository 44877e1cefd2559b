// Each reader below takes one key of docs/scenes.md.
#include "datasets/scene_file.h"

#include <algorithm>
#include <limits>
#include <numbers>
#include <set>
#include <tuple>

#include <fmt/format.h>

#include "datasets/frame_list.h"
#include "datasets/output_folder.h"
#include "datasets/scene_sensors.h"
#include "datasets/scene_values.h"
#include "datasets/target_yaml.h"
#include "datasets/yaml_reader.h"
#include "datasets/yaml_values.h"

namespace crumple {
namespace {

constexpr const char* schema_name = "crumple-scene/1";
constexpr double degree = std::numbers::pi / 180;
constexpr double largest_mm = 1e4;

Lighting read_lighting(const YamlValue& value) {
  YamlMap map = value.map();
  Lighting lighting;
  lighting.reference_distance_mm =
      number_or(map, "reference_distance_mm", lighting.reference_distance_mm, 1, largest_mm);
  lighting.ambient = number_or(map, "ambient", lighting.ambient, 0, 100);
  lighting.background = number_or(map, "background", lighting.background, 0, 100);
  map.finish();
  return lighting;
}

// Stands in beside a problem: a plate cannot be made of nothing.
const Target kStandIn{2, 3, 1};

BoardPlate read_plate(const YamlValue& value) {
  YamlMap map = value.map();
  const Target target = read_target(map);
  Eigen::Vector2d warp_mm = Eigen::Vector2d::Zero();
  if (const auto warp = map.find("warp_mm")) warp_mm = read_vector<2>(*warp, -10, 10);
  const double margin = number_or(map, "margin_mm", target.pitch_mm / 2, 0, largest_mm);
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

Crease read_crease(const YamlValue& value) {
  YamlMap map = value.map();
  Crease crease;
  if (const auto through = map.find("through_mm")) {
    crease.through_mm = read_vector<2>(*through, -largest_mm, largest_mm);
  }
  crease.direction_rad = degree * number_or(map, "direction_deg", 0, -360, 360);
  crease.angle_rad = degree * required_number(map, "angle_deg", "of the fold", -90, 90);
  crease.radius_mm = required_number(map, "radius_mm", "of the rounded edge", 0.5, largest_mm);
  map.finish();
  return crease;
}

Recess read_recess(const YamlValue& value) {
  YamlMap map = value.map();
  Recess recess;
  if (const auto centre = map.find("centre_mm")) recess.centre_mm = read_vector<2>(*centre, -largest_mm, largest_mm);
  if (const auto size = map.require("half_size_mm", "[along x, along y]")) {
    recess.half_size_mm = read_vector<2>(*size, 1, largest_mm);
  }
  recess.depth_mm = required_number(map, "depth_mm", "of the bowl", -1000, 1000);
  map.finish();
  return recess;
}

Dent read_dent(const YamlValue& value) {
  YamlMap map = value.map();
  Dent dent;
  if (const auto centre = map.find("centre_mm")) dent.centre_mm = read_vector<2>(*centre, -largest_mm, largest_mm);
  dent.radius_mm = required_number(map, "radius_mm", "of the dent, one sigma", 1, largest_mm);
  dent.depth_mm = required_number(map, "depth_mm", "of the dent, negative for a bump", -1000, 1000);
  map.finish();
  return dent;
}

Panel read_panel(const YamlValue& value) {
  YamlMap map = value.map();
  PanelShape shape;
  if (const auto size = map.require("size_mm", "[width, height]")) shape.size_mm = read_vector<2>(*size, 1, largest_mm);
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

void read_patterns(const YamlValue& value, Scene& scene) {
  YamlMap map = value.map();
  if (!scene.projector) return value.problem("needs a projector under `sensors`");
  if (const auto orientations = map.find("orientations")) {
    for (const YamlValue& item : orientations->list()) {
      scene.orientations.push_back(read_orientation(item, scene.projector->sensor.lens.size()));
    }
  }
  if (const auto board = map.find("chessboard"))
    scene.projected_chessboard = read_projected_chessboard(*board, scene.projector->sensor.lens.size());
  map.finish();
}

// The frames' grammar is capture.yaml's.
void read_scene_frames(const YamlValue& value, Scene& scene) {
  Capture capture;
  if (scene.projector) capture.projector = scene.projector->sensor.name;
  capture.orientations = scene.orientations;
  capture.projected_chessboard = scene.projected_chessboard;
  read_frames(value, capture);
  scene.frames = capture.frames;
}

// The board is placed by its middle, which is easier to aim than its first corner.
Pose placed_by_middle(Pose probe_from_middle, const Surface& surface) {
  const Extent extent = surface.extent();
  const Eigen::Vector2d middle = (extent.low + extent.high) / 2;
  probe_from_middle.translation -= probe_from_middle.rotation * Eigen::Vector3d(middle.x(), middle.y(), 0);
  return probe_from_middle;
}

SceneStation read_station(const YamlValue& value, const Scene& scene) {
  YamlMap map = value.map();
  SceneStation station;
  if (const auto id = map.require("id", "the station's name")) station.id = id->text();
  if (!station.id.empty() && !is_station_name(station.id)) {
    value.problem("a station's id holds no slashes and is not . or ..");
  }
  const auto board = map.find("board");
  const auto panel = map.find("panel");
  if (board.has_value() == panel.has_value()) {
    map.problem("must have either `board` or `panel`, where it is placed");
  }
  station.board = board.has_value();
  if (const auto& placed = board ? board : panel) {
    const bool known = board ? scene.board.has_value() : scene.panel.has_value();
    if (!known) placed->problem(fmt::format("describe the {} at the top level first", board ? "board" : "panel"));
    YamlMap place = placed->map();
    const Pose probe_from_middle = read_place(place);
    place.finish();
    if (known) station.probe_from_surface = placed_by_middle(probe_from_middle, surface_at(scene, station));
  }
  map.finish();
  return station;
}

void read_stations(const YamlValue& value, Scene& scene) {
  std::set<std::string> ids;
  for (const YamlValue& item : value.list()) {
    scene.stations.push_back(read_station(item, scene));
    const std::string& id = scene.stations.back().id;
    if (!ids.insert(id).second) item.problem(fmt::format("station `{}` is listed twice", id));
  }
  if (scene.stations.empty()) value.problem("at least one station is needed");
}

void read_root(const YamlValue& root, Scene& scene) {
  YamlMap map = root.map();
  if (const auto schema = map.require("schema", fmt::format("write `schema: {}`", schema_name))) {
    schema->one_of({schema_name});
  }
  if (const auto title = map.require("title", "one line that says what the scene shows")) scene.name = title->text();
  if (const auto seed = map.find("seed")) {
    scene.seed = static_cast<std::uint64_t>(seed->integer(0, std::numeric_limits<int>::max()));
  }
  if (const auto samples = map.find("samples_per_pixel")) scene.samples = samples->integer(1, 4096);
  if (const auto sensors = map.require("sensors", "the cameras and the projector")) read_scene_sensors(*sensors, scene);
  if (const auto lighting = map.find("lighting")) scene.lighting = read_lighting(*lighting);
  if (const auto board = map.find("board")) scene.board = read_plate(*board);
  if (const auto panel = map.find("panel")) scene.panel = read_panel(*panel);
  if (const auto patterns = map.find("patterns")) read_patterns(*patterns, scene);
  if (const auto frames = map.require("frames", "what each image of a station shows, in order")) {
    read_scene_frames(*frames, scene);
  }
  if (const auto stations = map.require("stations", "what is placed where, one item a station")) {
    read_stations(*stations, scene);
  }
  map.finish();
}

}  // namespace

Expected<Scene> parse_scene(const std::string& text, const std::string& file_name) {
  const auto document = parse_yaml(text, file_name);
  if (!document) return tl::unexpected(document.error());
  YamlProblems problems(file_name);
  Scene scene;
  read_root(YamlValue(*document, "", &problems), scene);
  if (auto error = problems.error()) return tl::unexpected<Error>(*error);
  return scene;
}

Expected<Scene> read_scene(const std::filesystem::path& file) {
  return read_file(file).and_then([&](const std::string& text) { return parse_scene(text, file.string()); });
}

}  // namespace crumple
