// `placements` and `stations` of scene files (docs/scenes.md): what stands where, and where the probe is.
#pragma once

#include "datasets/render/scene.h"
#include "datasets/yaml_reader.h"

namespace crumple {

// Fills the scene's stations. Needs its sensors, board and panel; `map` is the file's own. Problems go to the values.
void read_scene_stations(YamlMap& map, int schema, Scene& scene);

}  // namespace crumple
