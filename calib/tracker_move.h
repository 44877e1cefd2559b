// A campaign in which a tracker stands elsewhere from a station on: what it saw, told as by two trackers with one lens.
// It says nothing of whether that is so (calib/rig_check.h does).
#pragma once

#include <cstddef>
#include <vector>

#include "calib/calibration_data.h"

namespace crumple {

struct Move {
  std::size_t sensor = 0;  // of the data
  std::size_t first_station = 0;
};

// By trackers and stations: those that have LEDs read from both sides.
std::vector<Move> possible_moves(const CalibrationData& data);

// The tracker as two, the second ("... later") with the lens of the first, and a third one ("... untold") for boards
// and references, which were seen nobody knows when, where there are any. They are behind all others.
CalibrationData with_move(CalibrationData data, const Move& move);

// Without what a tracker saw nobody knows when.
CalibrationData without_untimed(CalibrationData data, std::size_t sensor);

}  // namespace crumple
