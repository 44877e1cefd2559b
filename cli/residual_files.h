// What calibrate leaves behind of its observations: residuals.csv, placements.yaml, and a picture of each image with
// the residuals drawn in.
#pragma once

#include <filesystem>

#include "cli/calibration_input.h"
#include "datasets/capture.h"
#include "solvers/expected.h"

namespace crumple {

// Writes residuals.csv, placements.yaml and, where `pictures` is set, overlays/STATION_CAMERA.png into the folder.
Expected<void> write_residual_files(const Capture& capture, const CalibrationInput& input,
                                    const Calibration& calibration, bool pictures, const std::filesystem::path& folder);

}  // namespace crumple
