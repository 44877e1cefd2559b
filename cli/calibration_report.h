// report.html of a calibration into its folder.
#pragma once

#include <string>

#include "cli/verb.h"
#include "datasets/output_folder.h"
#include "datasets/report/calibration_report.h"

namespace crumple {

// Words of a command line as a shell would take them.
std::string command_line(const VerbContext& context);

// Where it cannot be drawn that is said, and the calibration goes without it; fails where the folder cannot be written.
Expected<void> write_calibration_report(const CalibrationReport& report, const OutputFolder& folder);

}  // namespace crumple
