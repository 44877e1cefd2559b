// The answer of diff, for people and as JSON.
#pragma once

#include <string>

#include <nlohmann/json.hpp>

#include "calib/rig_difference.h"

namespace crumple {

std::string rig_difference_text(const RigDifference& difference);
nlohmann::json rig_difference_json(const RigDifference& difference);

}  // namespace crumple
