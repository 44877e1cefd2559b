// The things a scene shows: `board` and `panel` of scene files (docs/scenes.md).
#pragma once

#include "datasets/render/surfaces.h"
#include "datasets/yaml_reader.h"

namespace crumple {

BoardPlate read_plate(const YamlValue& value);
Panel read_panel(const YamlValue& value);

}  // namespace crumple
