// The start of a refinement from an earlier rig: its sensors and LEDs as they were, and the poses of placements and
// stations by what they see.
#pragma once

#include <map>
#include <string>

#include "calib/calibration_data.h"
#include "solvers/expected.h"
#include "solvers/state.h"

namespace crumple {

// Sensors and LEDs are matched by name. Boards are posed by their homographies to the rays of known lenses; stations,
// moved trackers and LEDs that the rig lacks follow as in calib/known_system.h. Ends of scale bars are located anew:
// bars are put down elsewhere each time. Of a probe that the rig knows nothing of, seen by trackers alone, the LEDs get
// a frame of their own (calib/led_frame.h). Fails on a sensor that the rig lacks and that is not the move of one it
// has, on one with another lens model, size or mount, and on what is not connected. `board_scales`, by boards' names,
// are true over nominal sizes where they are known better than by certificates.
Expected<CalibrationState> start_from_rig(const CalibrationData& data, const Rig& rig,
                                          const std::map<std::string, double>& board_scales);

// The rig without the ends of the data's scale bars: where these lie now it does not know.
Rig without_bars(Rig rig, const CalibrationData& data);

}  // namespace crumple
