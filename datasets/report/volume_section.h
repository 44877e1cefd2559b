// Where boards stood in the measuring volume, and what the calibration leaves open of points through it.
#pragma once

#include <string>

#include "calib/calibration_figures.h"

namespace crumple {

std::string volume_section(const CalibrationFigures& figures, const Calibration& calibration);

}  // namespace crumple
