// What summary.json says of the capture that a calibration was made from: who took it, when and how warm, with what,
// and under which certificates.
#pragma once

#include <nlohmann/json.hpp>

#include "datasets/capture.h"
#include "solvers/state.h"

namespace crumple {

// Of the sensors and boards of the calibration and of the capture's scale bars (docs/formats.md). What is not stated is
// left out.
nlohmann::json capture_summary(const Capture& capture, const CalibrationState& calibrated);

}  // namespace crumple
