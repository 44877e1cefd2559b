// The answer of check --rig, for people and as JSON.
#pragma once

#include <string>

#include <nlohmann/json.hpp>

#include "calib/rig_check.h"

namespace crumple {

std::string rig_check_text(const RigCheck& check);
nlohmann::json rig_check_json(const RigCheck& check);

}  // namespace crumple
