// What scene files say of trackers' images (docs/scenes.md): LEDs, false spots, the probe's body, chance.
#pragma once

#include "datasets/render/scene.h"
#include "datasets/yaml_reader.h"

namespace crumple {

// Fills the scene's tracking but for the trackers themselves, which are sensors. `map` is the file's own.
void read_scene_tracking(YamlMap& map, int schema, Scene& scene);

}  // namespace crumple
