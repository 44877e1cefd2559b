// Rows of a rig's covariance by their names.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "solvers/rig.h"

namespace crumple {

// The rows of a pose's tangent, behind the name of what has it: "cam0.rotation_x" ... "cam0.translation_z".
inline constexpr std::array<const char*, 6> kPoseRows{"rotation_x",    "rotation_y",    "rotation_z",
                                                      "translation_x", "translation_y", "translation_z"};

// Whether a row is a board's scale, as certificates and bars tell it: where there is none, the scale is not known.
bool is_scale(const std::string& name);

std::optional<Eigen::Index> find_row(const RigCovariance& covariance, const std::string& name);

// The joint covariance of some parameters, in their order; zero rows for those held fixed, which have none.
Eigen::MatrixXd covariance_of(const RigCovariance& covariance, const std::vector<std::string>& names);

}  // namespace crumple
