// The pose of a camera fixed to the world from points whose places there are known roughly: reference LEDs in the room,
// the probe's LEDs at stations that are posed, boards. It starts a tracker that was moved, whose lens is known, and
// trackers that share no board with the others.
#pragma once

#include <vector>

#include <Eigen/Core>

#include "solvers/expected.h"
#include "solvers/lens.h"
#include "solvers/observations.h"
#include "solvers/pose.h"
#include "solvers/rig.h"

namespace crumple {

// sensor_from_world. Points that are off by tens of pixels are left out. Fails with fewer than four points, and where
// these leave the pose open (tracking/probe_pose.h).
Expected<Pose> pose_tracker(const Lens& lens, const std::vector<Eigen::Vector3d>& in_world_mm,
                            const std::vector<Eigen::Vector2d>& pixels);

// The same for several cameras whose places in a frame of their own are known, their sensor_from_mount:
// frame_from_world. `seen` counts `trackers` as its sensors, and `in_world_mm`, each of which is seen, as its LEDs.
Expected<Pose> pose_trackers(const std::vector<Sensor>& trackers, const std::vector<Eigen::Vector3d>& in_world_mm,
                             const std::vector<LedView>& seen);

}  // namespace crumple
