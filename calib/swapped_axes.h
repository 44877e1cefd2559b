// Were a projector's columns and rows exchanged? With the one taken for the other its image is mirrored, and no pose
// and no lens undoes that: the calibration fails, or its stripes are off by many pixels.
#pragma once

#include <optional>
#include <string>

#include "calib/calibrate.h"

namespace crumple {

// The data with columns and rows of all projectors exchanged.
CalibrationData with_swapped_axes(CalibrationData data);

// A sentence where the data with exchanged axes can be calibrated and scatters by a fifth or less of what `found` does;
// `found` is none where the calibration as described failed. Looked for only there, or where a projector's stripes
// scatter by more than 2 px or a quarter of them are outliers.
std::optional<std::string> find_swapped_axes(const CalibrationData& data, const CalibrationOptions& options,
                                             const Calibration* found);

}  // namespace crumple
