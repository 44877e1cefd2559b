// What calibrate says of the lens models it compared: as JSON for summary.json, as text for the terminal.
#pragma once

#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "calib/choose_lens.h"

namespace crumple {

nlohmann::json lens_choice_summary(const std::vector<LensChoice>& choices);
std::string lens_choice_text(const std::vector<LensChoice>& choices);

}  // namespace crumple
