// An estimated rig beside the true one of a simulated capture, as JSON and as text.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "calib/rig_truth.h"
#include "cli/verb.h"
#include "solvers/expected.h"
#include "solvers/rig.h"

namespace crumple {

// {"parameters": [{name, estimate, truth, error, sigma, z}], "share_within_3_sigma": 0..1, "rms_z"}
nlohmann::json rig_truth_json(const std::vector<ParameterTruth>& parameters);
std::string rig_truth_text(const std::vector<ParameterTruth>& parameters);

// How far hand and eye are off: the LEDs as a rigid body in the probe's frame, against the true ones. Into the
// document's truth.hand_eye.NAME (mm at the LEDs' middle, deg) and the end of the text.
Expected<void> add_hand_eye_truth(const std::filesystem::path& folder, const Rig& estimated, const std::string& name,
                                  VerbResult& result);

// Both, for the truth in `folder`, into what a verb answers: the document's `truth` and the end of the text.
Expected<void> add_rig_truth(const std::filesystem::path& folder, const Rig& estimated, VerbResult& result);

}  // namespace crumple
