// Does the rig that stations were posed with still hold? check_rig() (calib/rig_check.h) on what their poses were made
// of: the pixels of the probe's LEDs in the trackers, those that poses left out among them.
//
// Stations whose pixels leave several poses say nothing of the rig and are passed over, and so are references in the
// room, since scale bars lie elsewhere each time.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "calib/rig_check.h"
#include "calib/station_poses.h"
#include "tracking/constellation.h"

namespace crumple {

// `stations`: by name, posed from pixels with this rig. Fails on a rig without a covariance and where no station is
// left to tell.
Expected<RigCheck> check_posed_rig(const Rig& rig, const std::vector<std::pair<std::string, Constellation>>& stations,
                                   int threads);

// A station whose own LEDs contradict each other: its pose is not to be trusted, whatever the rig.
struct MisfittingStation {
  std::string name;
  PoseMisfit misfit;
};

// Those less likely by chance than 1 in 1000 over all stations, `noisier` as the check found. Each by what its pose was
// made of; readings that were left out one by one do not count.
std::vector<MisfittingStation> misfitting_stations(const Rig& rig,
                                                   const std::vector<std::pair<std::string, Constellation>>& stations,
                                                   const NoiseFactors& noisier);

}  // namespace crumple
