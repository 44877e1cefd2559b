// Values that only scene files hold: places and materials. docs/scenes.md describes them.
#pragma once

#include "datasets/render/surfaces.h"
#include "datasets/yaml_reader.h"
#include "solvers/pose.h"

namespace crumple {

// position_mm (where the thing is in the probe frame) and rotation_deg (how it is turned there: a rotation vector,
// axis times angle). Both default to zero. The pose is probe_from_thing.
Pose read_place(YamlMap& map);

// albedo, gloss, roughness; what is missing stays as in `otherwise`.
Material read_material(const YamlValue& value, const Material& otherwise);

}  // namespace crumple
