// --pose and --near, of the verbs that find where a tracked probe was.
#pragma once

#include <gflags/gflags_declare.h>

#include "datasets/station_pose.h"
#include "solvers/expected.h"

DECLARE_string(near);

namespace crumple {

// Why there is no uncertainty of what markers pose, for summaries.
inline constexpr const char* kMarkersLack = "stations posed by markers have no covariance";

// What --pose comes to. The error is a usage error: a value that is none, and --near, which is about pixels.
Expected<PoseMethod> pose_method();

}  // namespace crumple
