// Where the stations of a tracked capture are, refined together (calib/refine_stations.h): a first pass over the images
// that keeps of each station its LED readings and a thinned sample of its surface. One view's images at a time are in
// memory; what is kept is a few thousand patches per view.
#pragma once

#include <map>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "calib/refine_stations.h"
#include "datasets/capture.h"
#include "datasets/station_pose.h"
#include "recon/station.h"

namespace crumple {

// A camera of the capture with the projector. Refers to its geometry.
struct ScanningCamera {
  std::string camera;
  std::size_t camera_index = 0;  // of the rig
  std::size_t projector_index = 0;
  const StationGeometry* geometry = nullptr;
};

struct RefinedStations {
  std::map<std::string, StationPose> poses;  // of the stations that were refined
  nlohmann::json summary;                    // docs/formats.md, `refined`
  std::string text;
};

// Stations without a pose from their LEDs are left to whoever reconstructs them, to be named there. Fails where
// refine_stations refuses.
Expected<RefinedStations> refined_stations(const Capture& capture, const Rig& rig,
                                           const std::vector<std::string>& stations,
                                           const std::vector<ScanningCamera>& cameras, const StationOptions& options);

}  // namespace crumple
