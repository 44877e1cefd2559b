// The `sensors` of scene.yaml (docs/scenes.md).
#pragma once

#include <string>

#include "datasets/render/scene.h"
#include "datasets/yaml_reader.h"

namespace crumple {

// Fills the scene's cameras, projectors and trackers; problems go to `value`. Of several projectors the one named
// `showing` shows the patterns, the first where it is empty.
void read_scene_sensors(const YamlValue& value, int schema, const std::string& showing, Scene& scene);

}  // namespace crumple
