// Boards that stay where they are in the room while the probe measures from several stations, as targets of
// refine_stations.h: every corner is a point of its own, so that neither the board's shape nor its pitch is believed.
//
// Where a corner lies, roughly, comes from the pose of its board before the first camera that saw it and from that
// station's own pose. Corners that only one station sees tie nothing and are left out, and so is a sight in which the
// board's pose cannot be told.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "calib/board_spec.h"
#include "calib/refine_stations.h"
#include "solvers/rig.h"

namespace crumple {

// A board as a camera of the probe saw it from a station. Indices are of the stations, the rig's sensors and the
// boards.
struct BoardSight {
  std::size_t station = 0;
  std::size_t camera = 0;
  std::size_t board = 0;
  std::string placement;  // sights of one board with the same one show it at the same place
  std::vector<int> corners;
  std::vector<Eigen::Vector2d> pixels;
};

struct RoomTargets {
  std::vector<RoomTarget> targets;                   // named placement/board/corner
  std::vector<std::vector<TargetReading>> readings;  // of each station
};

RoomTargets room_targets(const Rig& rig, const std::vector<Pose>& world_from_probe,
                         const std::vector<BoardSpec>& boards, const std::vector<BoardSight>& sights);

}  // namespace crumple
