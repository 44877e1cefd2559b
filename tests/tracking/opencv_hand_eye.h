// OpenCV's five hand-eye methods on our pairs.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "solvers/pose.h"
#include "tracking/pose_pairs.h"

namespace crumple {

inline const std::array<std::string, 5> kOpencvHandEyeMethods{"Tsai", "Park", "Horaud", "Andreff", "Daniilidis"};

// hand_from_eye by the method of that place; numbers that are not finite where OpenCV gives such or throws.
Pose opencv_hand_eye(const std::vector<PosePair>& pairs, std::size_t method);

}  // namespace crumple
