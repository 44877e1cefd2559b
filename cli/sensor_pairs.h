// Which cameras of a capture measure, and with which projectors.
#pragma once

#include <string>
#include <vector>

#include "datasets/capture.h"
#include "recon/station.h"
#include "solvers/rig.h"

namespace crumple {

// A camera of the capture that the rig knows, with a projector of the capture.
struct SensorPair {
  std::string camera;
  std::string projector;
  StationGeometry geometry;
};

// Cameras that the rig does not know are left out, with a warning. Fails where none is left, where the rig lacks a
// projector, and where a sensor of one name is another in capture and rig. `rig_folder` is what errors call the rig.
Expected<std::vector<SensorPair>> sensor_pairs(const Capture& capture, const Rig& rig, const std::string& rig_folder);

}  // namespace crumple
