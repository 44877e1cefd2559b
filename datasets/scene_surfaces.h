// The things a scene shows: `board`, `panel` and `objects` of scene files (docs/scenes.md).
#pragma once

#include <vector>

#include "datasets/render/scene.h"
#include "datasets/render/surfaces.h"
#include "datasets/yaml_reader.h"

namespace crumple {

BoardPlate read_plate(const YamlValue& value);
Panel read_panel(const YamlValue& value);

// `objects`, by their names.
std::vector<SceneObject> read_objects(const YamlValue& value);

}  // namespace crumple
