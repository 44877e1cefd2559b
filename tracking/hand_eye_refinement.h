// The hand-eye pose that explains all pairs of poses best, with its covariance: weighted least squares on the residuals
// of tracking/hand_eye_residuals.h over hand_from_eye, world_from_board and, between two streams, the time offset.
//
// In rounds: solve with the pairs accepted, estimate the noise from them, accept anew. The rule: a pair is accepted
// where the square of its six whitened residuals is below 25 (p = 3e-4), in units of the scale that makes the median
// over *all* pairs what normal errors make it (5.348); among few pairs the limit is widened by (1 + 5 / (n - 2))^2
// (Rousseeuw & Leroy's small-sample factor). It ends where the accepted pairs and the noise stay.
//
// The covariance is the inverse information; of streams with thirty pairs or more, that of serially correlated errors
// (tracking/serial_correlation.h). The noise is estimated, so with few pairs the sigmas are uncertain themselves.
#pragma once

#include <functional>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "solvers/expected.h"
#include "tracking/hand_eye_residuals.h"

namespace crumple {

// What there is to refine from: pairs by number at a time offset, or plain ones that know of no time.
struct PairSource {
  std::size_t size = 0;
  bool timed = false;
  std::function<std::optional<PosePair>(std::size_t index, double offset_s)> pair;
};

struct HandEyeFit {
  HandEyeState state;
  bool timed = false;  // whether there is a time offset; else it and its row of the covariance are zero
  // Tangents (solvers/pose.h) of hand_from_eye and world_from_board, then the offset.
  Eigen::Matrix<double, kHandEyeParameters, kHandEyeParameters> covariance;
  HandEyeNoise noise;
  std::vector<PosePair> pairs;       // at the offset found
  std::vector<char> accepted;        // of pairs
  double correlation_inflation = 1;  // of the variance, at most, by the errors' correlation in time
};

// Fails where fewer than three pairs remain, and where they do not determine the poses.
Expected<HandEyeFit> refine_hand_eye(const PairSource& source, const HandEyeState& start);

}  // namespace crumple
