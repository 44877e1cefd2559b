// The `sensors` of scene.yaml (docs/scenes.md).
#pragma once

#include "datasets/render/scene.h"
#include "datasets/yaml_reader.h"

namespace crumple {

// Fills the scene's cameras, projector and trackers; problems go to `value`.
void read_scene_sensors(const YamlValue& value, int schema, Scene& scene);

}  // namespace crumple
