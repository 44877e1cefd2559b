// The noise of every group of observations, and of every sensor what was seen where and what the model leaves over.
#pragma once

#include <string>

#include "datasets/report/calibration_report.h"
#include "datasets/report/report_figures.h"

namespace crumple {

std::string noise_section(const Calibration& calibration);

// Tests of the groups' residuals over their images.
std::string pattern_section(const CalibrationFigures& figures, const Calibration& calibration);

std::string sensor_sections(const CalibrationReport& report, ReportFigures& figures);

}  // namespace crumple
