// An estimated rig beside the true one of a simulated capture, as JSON and as text.
#pragma once

#include <string>

#include <nlohmann/json.hpp>

#include "calib/rig_truth.h"
#include "cli/verb.h"
#include "solvers/expected.h"
#include "solvers/rig.h"

namespace crumple {

// {"parameters": [{name, estimate, truth, error, sigma, z}], "share_within_3_sigma": 0..1, "rms_z",
//  "not_compared": [names]}
nlohmann::json rig_truth_json(const RigTruth& compared);
std::string rig_truth_text(const RigTruth& compared);

// How far hand and eye and the lenses are off: into the document's truth.hand_eye.NAME (mm at the LEDs' middle, deg)
// and truth.lenses_px.NAME.SENSOR of the sensors that the truth knows, and the end of the text.
Expected<void> add_system_truth(const Rig& truth, const Rig& estimated, const std::string& name, VerbResult& result);

// Both into what a verb answers: the document's `truth` and the end of the text.
Expected<void> add_rig_truth(const Rig& truth, const Rig& estimated, VerbResult& result);

}  // namespace crumple
