// What a calibration is given: sensors, boards, LEDs and what was observed.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "calib/board_spec.h"
#include "calib/initial_rig.h"
#include "calib/scale_bar.h"

namespace crumple {

// By sensors in the order of `sensors` (on each mount cameras first), and placements, stations and LEDs in the order of
// their names.
struct CalibrationData {
  std::vector<SensorSpec> sensors;
  std::vector<BoardSpec> boards;
  std::vector<std::size_t> board_of;            // the board each placement is of
  std::optional<Temperature> temperature = {};  // of the boards
  std::vector<std::string> placement_names;
  Observations observations;
  std::vector<PixelPairs> pairs;                // for the projectors' start
  std::vector<std::string> station_names = {};  // of a probe that is moved about; none where it stands still
  // Positions are not used. LEDs that nothing shows may be there where an earlier rig knows them.
  std::vector<Led> leds = {};
  std::vector<ScaleBar> bars = {};
  // Whether what nothing tells of the rig is held weakly (calib/determined_part.h) where it is an error otherwise.
  bool may_be_open = false;
};

// The boards as they are said to be: flat, of nominal size or of the certificate's at the capture's temperature.
std::vector<Board> nominal_boards(const CalibrationData& data);

}  // namespace crumple
