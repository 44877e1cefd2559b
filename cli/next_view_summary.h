// What calibrate --suggest says of the views to take next: as JSON for summary.json, as text for the terminal.
#pragma once

#include <string>

#include <nlohmann/json.hpp>

#include "calib/next_view.h"

namespace crumple {

nlohmann::json next_views_summary(const NextViews& next, const Calibration& calibration);
std::string next_views_text(const NextViews& next, const Calibration& calibration);

}  // namespace crumple
