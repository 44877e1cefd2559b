// What a calibration was made from: the capture and its circumstances; the run, its inputs and their hashes.
#pragma once

#include <string>

#include "datasets/report/calibration_report.h"

namespace crumple {

std::string capture_section(const CalibrationReport& report);

std::string inputs_section(const RunRecord& record, const std::string& command);

}  // namespace crumple
