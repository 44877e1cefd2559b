// Trackers that share no board placement with the others, joined to them by LEDs.
//
// Their own boards tell their lenses and, where there are several of them, how they stand to each other. Where they
// stand in the world follows from LEDs that they read at stations the others pose: a resection
// (calib/pose_tracker.h). What they see of boards follows from that.
#pragma once

#include <cstddef>
#include <map>
#include <vector>

#include "calib/known_system.h"
#include "solvers/expected.h"

namespace crumple {

// Trackers that boards join among themselves. Each sensor_from_mount is from a frame of their own until they are
// joined, and they count among KnownSystem::moved_trackers.
struct TrackerGroup {
  std::vector<std::size_t> sensors;              // of the whole
  std::map<std::size_t, Pose> frame_from_board;  // by placement
};

// frame_from_world, by the probe's LEDs at stations that are posed and the room's that two posed trackers see. Fails
// with fewer than four such points, and where these leave the pose open.
Expected<Pose> pose_group(const CalibrationData& data, const TrackerGroup& group, const KnownSystem& known);

// Puts the group's trackers and boards into the world.
void join(const TrackerGroup& group, const Pose& frame_from_world, KnownSystem& known);

}  // namespace crumple
