#include "datasets/scene_stations.h"

#include <map>
#include <optional>
#include <set>
#include <string>

#include <fmt/format.h>

#include "datasets/scene_values.h"
#include "datasets/yaml_values.h"

namespace crumple {
namespace {

// What stands where, in the world frame or, where the probe stands still, in its own.
struct Placed {
  bool board = true;
  std::optional<std::size_t> object;
  Pose frame_from_surface;
};

// Boards and panels are placed by their middle, which is easier to aim than a first corner.
Pose placed_by_middle(Pose frame_from_middle, const Surface& surface) {
  const Extent extent = surface.extent();
  const Eigen::Vector2d middle = (extent.low + extent.high) / 2;
  frame_from_middle.translation -= frame_from_middle.rotation * Eigen::Vector3d(middle.x(), middle.y(), 0);
  return frame_from_middle;
}

// `object: {name: NAME}` and a PLACE in it.
std::optional<Placed> read_placed_object(const YamlValue& value, const Scene& scene) {
  YamlMap map = value.map();
  const auto name = map.require("name", "of the object that is placed");
  const Pose frame_from_middle = read_place(map);
  map.finish();
  if (!name) return std::nullopt;
  const std::string wanted = name->text();
  for (std::size_t i = 0; i < scene.objects.size(); ++i) {
    if (scene.objects[i].name != wanted) continue;
    return Placed{false, i, placed_by_middle(frame_from_middle, *scene.objects[i].surface)};
  }
  name->problem(fmt::format("there is no object `{}`: describe it under `objects`", wanted));
  return Placed{false, {}, frame_from_middle};
}

// `board: PLACE`, `panel: PLACE` or an object; nothing where there is none.
std::optional<Placed> read_placed(YamlMap& map, const Scene& scene) {
  const auto board = map.find("board");
  const auto panel = map.find("panel");
  const auto object = map.find("object");
  if (int{board.has_value()} + int{panel.has_value()} + int{object.has_value()} > 1) {
    map.problem("must have either `board` or `panel` or `object`, where it is placed");
  }
  if (object) return read_placed_object(*object, scene);
  const auto& placed = board ? board : panel;
  if (!placed) return std::nullopt;
  const bool known = board ? scene.board.has_value() : scene.panel.has_value();
  if (!known) placed->problem(fmt::format("describe the {} at the top level first", board ? "board" : "panel"));
  YamlMap place = placed->map();
  const Pose frame_from_middle = read_place(place);
  place.finish();
  if (!known) return Placed{board.has_value(), {}, frame_from_middle};
  const Surface& surface = board ? static_cast<const Surface&>(*scene.board) : *scene.panel;
  return Placed{board.has_value(), {}, placed_by_middle(frame_from_middle, surface)};
}

using NamedPlaces = std::map<std::string, Placed>;

NamedPlaces read_placements(const YamlValue& value, const Scene& scene) {
  NamedPlaces placements;
  YamlMap map = value.map();
  if (scene.tracking.trackers.empty()) value.problem("needs a camera with `mount: world`: else the probe stands still");
  for (const auto& [name, item] : map.entries()) {
    YamlMap entry = item.map();
    const std::optional<Placed> placed = read_placed(entry, scene);
    if (!placed) entry.problem("must have `board` or `panel`, where it is placed");
    entry.finish();
    if (placed) placements.emplace(name, *placed);
  }
  return placements;
}

// What only stations of a probe that is tracked have.
std::optional<Placed> read_tracked(YamlMap& map, const NamedPlaces& placements, std::optional<Placed> placed,
                                   SceneStation& station) {
  if (const auto probe = map.require("probe", "where the probe is in the world")) {
    YamlMap place = probe->map();
    station.world_from_probe = read_place(place);
    place.finish();
  }
  if (const auto name = map.find("placement")) {
    station.placement = name->text();
    const auto found = placements.find(station.placement);
    if (placed) name->problem("stands beside a place: keep one");
    if (found != placements.end()) {
      placed = found->second;
    } else if (!station.placement.empty()) {
      name->problem(fmt::format("there is no placement `{}`: list it under `placements`", station.placement));
    }
  }
  if (const auto scan = map.find("scan")) station.scan = scan->boolean();
  if (const auto trackers = map.find("trackers")) station.trackers = trackers->boolean();
  if (!station.scan && !station.trackers) map.problem("has neither a scan nor trackers: leave the station out");
  if (!placed && station.scan && !map.find("placement")) {
    map.problem("shows nothing: give `board`, `panel` or `placement`, or say `scan: false`");
  }
  return placed;
}

SceneStation read_scene_station(const YamlValue& value, const NamedPlaces& placements, const Scene& scene) {
  YamlMap map = value.map();
  SceneStation station;
  if (const auto id = map.require("id", "the station's name")) station.id = id->text();
  if (!station.id.empty() && !is_station_name(station.id)) {
    value.problem("a station's id holds no slashes and is not . or ..");
  }
  std::optional<Placed> placed = read_placed(map, scene);
  if (!scene.tracking.trackers.empty()) {
    placed = read_tracked(map, placements, placed, station);
  } else if (!placed) {
    map.problem("must have either `board` or `panel`, where it is placed");
  }
  map.finish();
  station.in_view = placed.has_value();
  station.board = !placed || placed->board;
  if (placed) station.object = placed->object;
  if (placed) station.probe_from_surface = station.world_from_probe.inverse() * placed->frame_from_surface;
  return station;
}

}  // namespace

void read_scene_stations(YamlMap& map, int schema, Scene& scene) {
  NamedPlaces placements;
  if (const auto value = find_new_in_scene_2(map, "placements", schema)) placements = read_placements(*value, scene);
  const auto value = map.require("stations", "what is placed where, one item a station");
  if (!value) return;
  std::set<std::string> ids;
  for (const YamlValue& item : value->list()) {
    scene.stations.push_back(read_scene_station(item, placements, scene));
    const std::string& id = scene.stations.back().id;
    if (!ids.insert(id).second) item.problem(fmt::format("station `{}` is listed twice", id));
  }
  if (scene.stations.empty()) value->problem("at least one station is needed");
}

}  // namespace crumple
