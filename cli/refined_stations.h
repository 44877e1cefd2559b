// Where the stations of a tracked capture are, refined together (calib/refine_stations.h): a first pass over the images
// that keeps of each station its LED readings and a thinned sample of its surface. One view's images at a time are in
// memory; what is kept is a few thousand patches per view.
#pragma once

#include <map>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "calib/refined_knowledge.h"
#include "cli/sensor_pairs.h"
#include "datasets/capture.h"
#include "datasets/near_poses.h"
#include "recon/station.h"

namespace crumple {

// Poses and rig belong together: where the rig was free, poses hold what it moved by.
struct RefinedStations {
  std::map<std::string, StationPose> poses;  // of the stations that were refined
  Rig rig;                                   // with what the refinement made of its covariance
  StationPoses known;                        // the poses with their dependence on the rig
  nlohmann::json summary;                    // docs/formats.md, `refined`
  std::string text;
};

// Stations without a pose from their LEDs are left to whoever reconstructs them, to be named there. Fails where
// refine_stations refuses.
Expected<RefinedStations> refined_stations(const Capture& capture, const Rig& rig,
                                           const std::vector<std::string>& stations,
                                           const std::vector<SensorPair>& pairs, const StationOptions& options,
                                           NearPoses near);

}  // namespace crumple
