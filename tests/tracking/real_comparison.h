// The recordings of real_hand_eye.h, ours beside OpenCV's five methods on the same pairs: the board's scatter.
#pragma once

#include <string>
#include <vector>

#include "solvers/expected.h"
#include "tests/tracking/real_hand_eye.h"
#include "tracking/hand_eye.h"

namespace crumple {

struct MethodScatter {
  std::string method;
  Pose hand_from_eye;
  BoardScatter scatter;
};

struct PairSetComparison {
  std::string pairs;                   // how they were chosen
  std::vector<MethodScatter> methods;  // ours from these pairs alone, ours from the streams, then OpenCV's
};

struct RealComparison {
  HandEyeCalibration calibration;  // from the streams
  std::vector<PairSetComparison> sets;
};

// Two choices of pairs at the offset found. "accepted": every fifth pair that our rule accepts. "calm": of the 30 %
// at which the eye's poses turn slowest every sixth, outliers included, as one would pick stills from a recording.
Expected<RealComparison> compare_on_recording(const RealHandEye& set, const std::filesystem::path& unpacked);

}  // namespace crumple
