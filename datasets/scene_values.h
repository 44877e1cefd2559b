// Values that scene files are made of: numbers with a default, vectors, poses. docs/scenes.md describes them.
#pragma once

#include <string>

#include <Eigen/Core>

#include "datasets/render/surfaces.h"
#include "datasets/yaml_reader.h"
#include "solvers/lens.h"
#include "solvers/pose.h"

namespace crumple {

double number_or(YamlMap& map, const std::string& key, double otherwise, double lowest, double highest);
double required_number(YamlMap& map, const std::string& key, const std::string& what, double lowest, double highest);

// A list of exactly N numbers between the bounds; zeros beside a problem.
template <int N>
Eigen::Matrix<double, N, 1> read_vector(const YamlValue& value, double lowest, double highest);

ImageSize read_size_px(YamlMap& map);

// position_mm (where the thing is in the probe frame) and rotation_deg (how it is turned there: a rotation vector,
// axis times angle). Both default to zero. The pose is probe_from_thing.
Pose read_place(YamlMap& map);

// albedo, gloss, roughness; what is missing stays as in `otherwise`.
Material read_material(const YamlValue& value, const Material& otherwise);

}  // namespace crumple
