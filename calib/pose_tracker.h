// The pose of a camera fixed to the world from points whose places there are known roughly: reference LEDs in the room,
// the probe's LEDs at stations that are posed, boards. It starts a tracker that was moved, whose lens is known.
#pragma once

#include <vector>

#include <Eigen/Core>

#include "solvers/expected.h"
#include "solvers/lens.h"
#include "solvers/pose.h"

namespace crumple {

// sensor_from_world. Points that are off by tens of pixels are left out. Fails with fewer than four points, and where
// these leave the pose open (tracking/probe_pose.h).
Expected<Pose> pose_tracker(const Lens& lens, const std::vector<Eigen::Vector3d>& in_world_mm,
                            const std::vector<Eigen::Vector2d>& pixels);

}  // namespace crumple
