// The sensors of one mount of a tracked system, as a capture of their own: the probe's stand still and see every board
// at every station as a placement of its own; the trackers' see the boards fixed to the world.
#pragma once

#include <cstddef>
#include <vector>

#include "calib/calibration_data.h"
#include "calib/known_system.h"

namespace crumple {

// Without LEDs, and without the later set-ups of a tracker, whose lens the first one tells, and what these see. Its
// sensors count as on a probe; placements carry names that say which board and station they are.
struct SystemPart {
  CalibrationData data;
  std::vector<std::size_t> sensors;       // of the whole, by the part's numbers
  std::vector<BoardSighting> placements;  // likewise
};

SystemPart system_part(const CalibrationData& whole, Mount mount);

// The same, cut where no board is seen from both sides at once: each part can be calibrated by itself, and no two share
// a placement. In the order of their first sensors.
std::vector<SystemPart> joined_parts(const CalibrationData& whole, Mount mount);

}  // namespace crumple
