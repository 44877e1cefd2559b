// What the LEDs that stations were posed by tell of the rig they were posed with (calib/posed_rig_check.h), as track
// and reconstruct say it.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include "calib/posed_rig_check.h"

namespace crumple {

struct PosedRig {
  bool holds = true;        // as far as anything tells
  nlohmann::json document;  // docs/formats.md, `rig_check`
  std::string text;         // a line per change and on what none explains, or why nothing tells
  std::vector<MisfittingStation> misfits =
      {};  // where the rig holds: stations whose poses are not to be trusted, which `text` names
  NoiseFactors noisier = {};
};

// What the LED pixels leave open of a pose, by the noise that they turned out to have.
Matrix6d restated_covariance(const Rig& rig, const Constellation& where, const NoiseFactors& noisier);

PosedRig posed_rig(const Rig& rig, const std::vector<std::pair<std::string, Constellation>>& stations);

}  // namespace crumple
