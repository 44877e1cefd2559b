// A cloud taken from one frame into another.
#pragma once

#include <string>

#include "recon/cloud.h"
#include "solvers/pose.h"

namespace crumple {

// Positions, normals and covariances; `frame` is what the cloud's frame is called then.
Cloud moved(Cloud cloud, const Pose& target_from_cloud, const std::string& frame);

}  // namespace crumple
