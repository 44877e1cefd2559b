// Where a sensor stands and what its pinhole is, from points known in space: the direct linear transform of the
// 3x4 projection, split into intrinsics and pose.
//
// Source: Hartley & Zisserman, Multiple View Geometry (2nd ed.), algorithm 7.1 (normalised DLT) and section 6.2.4 (RQ).
// It needs six points not on one plane. With the camera known, all board placements together give a projector such
// points: unlike Zhang's form it has no trouble with few tilts or an offset lens.
#pragma once

#include <vector>

#include <Eigen/Core>

#include "solvers/closed_form/homography.h"
#include "solvers/closed_form/zhang.h"

namespace crumple {

struct Resection {
  PinholeIntrinsics intrinsics;  // the skew of the split is dropped
  Pose sensor_from_points;
};

// Fails with fewer than six points and where they lie (nearly) on one plane.
Expected<Resection> resect(const std::vector<Eigen::Vector3d>& points, const Points2d& pixels);

}  // namespace crumple
