// The mean of poses.
//
// Source of the rotation's: F. L. Markley et al., Averaging quaternions, J. Guidance 30(4), 2007: the eigenvector of
// the largest eigenvalue of the quaternions' outer products. Precondition: at least one pose.
#pragma once

#include <vector>

#include "solvers/pose.h"

namespace crumple {

Pose mean_pose(const std::vector<Pose>& poses);

}  // namespace crumple
