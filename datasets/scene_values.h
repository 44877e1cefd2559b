// Values that only scene files hold: places and materials. docs/scenes.md describes them.
#pragma once

#include <optional>
#include <string>

#include "datasets/render/surfaces.h"
#include "datasets/yaml_reader.h"
#include "solvers/pose.h"

namespace crumple {

constexpr double kLargestScene_mm = 1e4;

// A key of crumple-scene/2, which is a problem in a file of version 1.
std::optional<YamlValue> find_new_in_scene_2(YamlMap& map, const std::string& key, int schema);

// position_mm (where the thing is in a frame) and rotation_deg (how it is turned there: a rotation vector, axis times
// angle). Both default to zero. The pose is frame_from_thing.
Pose read_place(YamlMap& map);

// albedo, gloss, roughness; what is missing stays as in `otherwise`.
Material read_material(const YamlValue& value, const Material& otherwise);

}  // namespace crumple
