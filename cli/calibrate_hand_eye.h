// `crumple calibrate --hand_eye`: two streams of poses, or with --paired two lists -> the eye's pose on the hand.
#pragma once

#include "cli/verb.h"
#include "solvers/expected.h"

namespace crumple {

// Writes hand_eye.yaml, covariance.npy and summary.json.
Expected<VerbResult> run_calibrate_hand_eye(const VerbContext& context);

}  // namespace crumple
