// Does the rig that stations were posed with still hold? check_rig() (calib/rig_check.h) on what their poses were made
// of: the pixels of the probe's LEDs in the trackers.
//
// A pose leaves out the readings that contradict most others. One by one they are misread; where they are most of what
// was read of a tracker, or of an LED, over all stations, it is that which changed, and they count here.
//
// Stations whose pixels leave several poses say nothing of the rig and are passed over, and so are references in the
// room, since scale bars lie elsewhere each time.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "calib/rig_check.h"
#include "tracking/constellation.h"

namespace crumple {

// `stations`: by name, posed from pixels with this rig. Fails on a rig without a covariance and where no station is
// left to tell.
Expected<RigCheck> check_posed_rig(const Rig& rig, const std::vector<std::pair<std::string, Constellation>>& stations,
                                   int threads);

}  // namespace crumple
