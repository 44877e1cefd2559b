// What `crumple calibrate` says of a calibration: summary.json (docs/formats.md) and a page of text.
#pragma once

#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "calib/verdict.h"
#include "cli/calibration_input.h"

namespace crumple {

nlohmann::json calibration_summary(const Calibration& calibration, const Verdict& verdict,
                                   const std::vector<SkippedView>& skipped);

std::string calibration_text(const Calibration& calibration, const Verdict& verdict,
                             const std::vector<SkippedView>& skipped);

}  // namespace crumple
