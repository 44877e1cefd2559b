// The rigid motion that carries points onto their partners best.
//
// Source: Umeyama, Least-squares estimation of transformation parameters between two point patterns, PAMI 1991, without
// scale.
#pragma once

#include <vector>

#include <Eigen/Core>

#include "solvers/expected.h"
#include "solvers/pose.h"

namespace crumple {

// b_from_a minimising sum |b - b_from_a a|^2. Fails with fewer than three points and where they lie on a line.
Expected<Pose> rigid_fit(const std::vector<Eigen::Vector3d>& a, const std::vector<Eigen::Vector3d>& b);

}  // namespace crumple
