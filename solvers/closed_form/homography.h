// The homography between two planes from point pairs: the normalised direct linear transform.
//
// Source: Hartley & Zisserman, Multiple View Geometry (2nd ed.), algorithm 4.2. Both point sets are moved to their
// centroid and scaled to a mean distance of sqrt(2); the answer minimises the algebraic error in those coordinates.
#pragma once

#include <vector>

#include <Eigen/Core>

#include "solvers/expected.h"

namespace crumple {

using Points2d = std::vector<Eigen::Vector2d>;

// b ~ H a. Scaled to unit Frobenius norm with H(2,2) >= 0. Fails with fewer than four pairs and where they do not
// determine it (three of four on a line, all on a line).
Expected<Eigen::Matrix3d> homography(const Points2d& a, const Points2d& b);

Eigen::Vector2d apply_homography(const Eigen::Matrix3d& b_from_a, const Eigen::Vector2d& a);

// The similarity that moves points to their centroid and a mean distance of sqrt(2) from it.
Eigen::Matrix3d normalising_similarity(const Points2d& points);

}  // namespace crumple
