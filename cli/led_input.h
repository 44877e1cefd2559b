// What cameras fixed to the world see of LEDs, as a calibration takes it.
#pragma once

#include <string>
#include <vector>

#include "cli/calibration_input.h"

namespace crumple {

// Its number among the stations of a probe that is moved about; it becomes one of them.
std::size_t station_number(const std::string& id, CalibrationData& data);

// Adds the LEDs that are read, scale bars and what is seen of them. LEDs seen at several places at once lose that view;
// stations at which the probe or a tracker moved between the repetitions of the words lose all views of LEDs
// (tracking/stillness.h); LEDs that are read nowhere else, and references that only one camera sees, are left out
// altogether: all by name, among the views that were skipped. Of the LEDs that an earlier rig knows, if the calibration
// goes on from one, none is left out while any sensor is fixed to the world: its place is known without being seen.
// Ends of scale bars are not known, since bars are put down elsewhere each time. Fails on images that cannot be read,
// and on scale bars that are not seen.
Expected<void> read_leds(const Capture& capture, const std::vector<Led>& earlier, int threads, CalibrationInput& input);

}  // namespace crumple
