// The covariance of a rig of which some parts were kept as an earlier rig has them, while others were corrected.
//
// What is kept is as uncertain as it was, and its errors are in what is corrected beside it: new observations are
// explained by parts that are off. With P the covariance of the kept parts b in the earlier rig, and C what it would be
// if everything were corrected, the estimate of the others given b follows b by K = C_xb C_bb^-1, and
//   cov(x, b) = C + M (P - C_bb) M',   M = [K; 1],
// the conditional covariance plus what K makes of P (consider parameters: Tapley, Schutz & Born, Statistical Orbit
// Determination, 2004, ch. 6).
#pragma once

#include <set>

#include "calib/calibrate.h"

namespace crumple {

// `calibration` was refined with `kept` held, from these observations and with these priors, and widened
// (calib/weighting.h). With rows of all that the earlier rig has a covariance of. Fails where the observations, with
// the earlier rig's knowledge, do not determine everything.
Expected<JointCovariance> covariance_with_kept(const Observations& observations, const Calibration& calibration,
                                               const std::set<BlockId>& kept, int threads);

}  // namespace crumple
