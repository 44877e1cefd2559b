// What the LEDs that stations were posed by tell of the rig they were posed with (calib/posed_rig_check.h), as track
// and reconstruct say it.
#pragma once

#include <string>

#include <nlohmann/json.hpp>

#include "calib/posed_rig_check.h"

namespace crumple {

struct PosedRig {
  bool holds = true;        // as far as anything tells
  nlohmann::json document;  // docs/formats.md, `rig_check`
  std::string text;         // a line per change and on what none explains, or why nothing tells
};

PosedRig posed_rig(const Rig& rig, const std::vector<std::pair<std::string, Constellation>>& stations);

}  // namespace crumple
