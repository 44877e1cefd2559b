// The figures of a calibration's report as JSON, for summary.json (docs/formats.md): the same numbers.
#pragma once

#include <string>

#include <nlohmann/json.hpp>

#include "calib/calibration_figures.h"

namespace crumple {

// Its keys stand beside those of calibration_summary.
nlohmann::json figures_summary(const CalibrationFigures& figures, const Calibration& calibration);

// Of the maps at distances asked for, a line each for the terminal.
std::string projection_maps_text(const CalibrationFigures& figures, const Calibration& calibration);

}  // namespace crumple
