// What the calibration leaves open of points through the measuring volume.
#pragma once

#include <string>

#include "calib/volume_uncertainty.h"

namespace crumple {

std::string volume_section(const VolumePoints& volume, const Calibration& calibration);

}  // namespace crumple
