// Each reader below takes one key of docs/scenes.md.
#include "datasets/scene_file.h"

#include <algorithm>
#include <limits>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "datasets/frame_list.h"
#include "datasets/output_folder.h"
#include "datasets/scene_sensors.h"
#include "datasets/scene_stations.h"
#include "datasets/scene_surfaces.h"
#include "datasets/scene_tracking.h"
#include "datasets/scene_values.h"
#include "datasets/yaml_reader.h"
#include "datasets/yaml_values.h"

namespace crumple {
namespace {

// Version 2 added keys and changed none.
const std::vector<std::string> kSceneSchemas = {"crumple-scene/2", "crumple-scene/1"};

Lighting read_lighting(const YamlValue& value, int schema, const Scene& scene) {
  YamlMap map = value.map();
  Lighting lighting;
  lighting.reference_distance_mm =
      number_or(map, "reference_distance_mm", lighting.reference_distance_mm, 1, kLargestScene_mm);
  lighting.ambient = number_or(map, "ambient", lighting.ambient, 0, 100);
  lighting.background = number_or(map, "background", lighting.background, 0, 100);
  if (const auto thermal = find_new_in_scene_2(map, "thermal_background", schema)) {
    lighting.thermal_background = thermal->number(0, 100);
  }
  if (const auto bounces = find_new_in_scene_2(map, "bounces", schema)) {
    lighting.bounce = bounces->integer(0, 1) == 1;
    // Each such ray may light a place of its own on the projector's panel, and a pixel counts to 255 of them.
    if (lighting.bounce && scene.samples > 16) bounces->problem("goes with `samples_per_pixel` of 16 at most");
  }
  map.finish();
  return lighting;
}

// The projector that shows the patterns, by name; empty where the scene does not say.
std::string showing_projector(YamlMap& root, int schema) {
  const auto patterns = root.find("patterns");
  if (!patterns || !patterns->is_map()) return {};
  YamlMap map = patterns->map();
  const auto projector = find_new_in_scene_2(map, "projector", schema);
  return projector ? projector->text() : "";
}

void read_patterns(const YamlValue& value, Scene& scene) {
  YamlMap map = value.map();
  const auto showing = map.find("projector");
  if (showing && (!scene.projector || scene.projector->sensor.name != showing->text())) {
    showing->problem("is not a projector under `sensors`");
  }
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

void read_root(const YamlValue& root, Scene& scene) {
  YamlMap map = root.map();
  int schema = 2;
  if (const auto stated = map.require("schema", fmt::format("write `schema: {}`", kSceneSchemas.front()))) {
    schema = stated->one_of(kSceneSchemas) == kSceneSchemas.back() ? 1 : 2;
  }
  if (const auto title = map.require("title", "one line that says what the scene shows")) scene.name = title->text();
  if (const auto seed = map.find("seed")) {
    scene.seed = static_cast<std::uint64_t>(seed->integer(0, std::numeric_limits<int>::max()));
  }
  if (const auto samples = map.find("samples_per_pixel")) scene.samples = samples->integer(1, 4096);
  if (const auto sensors = map.require("sensors", "the cameras and the projector"))
    read_scene_sensors(*sensors, schema, showing_projector(map, schema), scene);
  if (const auto lighting = map.find("lighting")) scene.lighting = read_lighting(*lighting, schema, scene);
  if (const auto board = map.find("board")) scene.board = read_plate(*board);
  if (const auto panel = map.find("panel")) scene.panel = read_panel(*panel);
  if (const auto objects = find_new_in_scene_2(map, "objects", schema)) scene.objects = read_objects(*objects);
  if (const auto patterns = map.find("patterns")) read_patterns(*patterns, scene);
  const auto frames = map.find("frames");
  if (frames) {
    read_scene_frames(*frames, scene);
  } else if (!scene.cameras.empty() || scene.tracking.trackers.empty()) {
    map.problem("`frames` is missing: what each image of a station shows, in order");
  }
  read_scene_tracking(map, schema, scene);
  read_scene_stations(map, schema, scene);
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
