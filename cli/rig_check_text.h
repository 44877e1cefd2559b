// The answer of check --rig, for people and as JSON.
#pragma once

#include <string>

#include <nlohmann/json.hpp>

#include "calib/rig_check.h"

namespace crumple {

// Lines on what does not belong to a part: LEDs that scatter more than at the calibration, and what no change explains.
std::string unexplained_text(const RigCheck& check);

// A line on a tracker that was moved while the images were taken.
std::string moved_text(const MovedMeanwhile& moved);

std::string rig_check_text(const RigCheck& check);
nlohmann::json rig_check_json(const RigCheck& check);

}  // namespace crumple
