// What `crumple calibrate` says of a calibration: summary.json (docs/formats.md) and a page of text.
#pragma once

#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "calib/cross_validate.h"
#include "calib/verdict.h"
#include "cli/calibration_input.h"

namespace crumple {

nlohmann::json calibration_summary(const Calibration& calibration, const Verdict& verdict,
                                   const std::vector<SkippedView>& skipped);

std::string calibration_text(const Calibration& calibration, const Verdict& verdict,
                             const std::vector<SkippedView>& skipped);

nlohmann::json cross_validation_summary(const CrossValidation& validation);
std::string cross_validation_text(const CrossValidation& validation);

}  // namespace crumple
