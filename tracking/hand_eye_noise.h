// How much the poses of a hand-eye calibration err, estimated from its residuals.
#pragma once

#include <vector>

#include "tracking/hand_eye_residuals.h"

namespace crumple {

// From medians, without the hand's share: whatever up to half of the pairs say. The median of the square of three
// normal deviates is 2.366.
HandEyeNoise robust_noise(const std::vector<HandEyeResidual>& residuals);

// The most likely noise (hand_eye_residuals.h) of what the accepted pairs leave, each kind over its redundancy. With
// fewer than eight pairs the hand's share is not told and stays zero.
HandEyeNoise most_likely_noise(const std::vector<HandEyeResidual>& accepted);

}  // namespace crumple
