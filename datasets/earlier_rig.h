// A rig on disk as a calibration goes on from it: with what was found of its boards.
#pragma once

#include <filesystem>

#include "calib/calibrate.h"

namespace crumple {

// The rig's folder, and the boards' scales from its placements.yaml where that is there. Without it boards are taken to
// be of their nominal or certified sizes.
Expected<EarlierRig> read_earlier_rig(const std::filesystem::path& folder);

}  // namespace crumple
