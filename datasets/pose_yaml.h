// Poses in Crumple's own YAML files: quaternion_wxyz, of unit length to 1e-9, and translation_mm.
#pragma once

#include <string>

#include "datasets/yaml_reader.h"
#include "solvers/pose.h"

namespace crumple {

// Two lines, indented by `indent`; read back exactly.
std::string pose_yaml(const Pose& pose, int indent);

Pose read_pose(const YamlValue& value);

}  // namespace crumple
