// Is a hand-eye pose to be trusted? A verdict with reasons a person can act on.
//
// suspect where: all rotations, or those about other axes than the main one, are below five times what hand and eye
// disagree by (below twice that the closed form refuses; solvers/closed_form/hand_eye.h); the pose is less certain than
// 0.5 deg or 5 mm along any direction; fewer than five pairs were accepted, or more than a quarter of them left out;
// the offset of the refinement and that of the angular rates are further apart than five of their sigmas and 5 ms.
#pragma once

#include <string>
#include <vector>

#include "tracking/hand_eye.h"

namespace crumple {

struct HandEyeVerdict {
  bool ok = true;
  std::vector<std::string> reasons;  // why not; empty where ok
};

HandEyeVerdict judge(const HandEyeCalibration& calibration);

}  // namespace crumple
