// Which terms the observations do not determine: those that a weak prior decides.
//
// With the whitened Jacobian J of a weak prior and the joint covariance C of the fit, J C J' is the prior's hat matrix:
// its eigenvalues, 0 to 1, are the shares of what is known along a direction that come from the prior and not from the
// observations. A direction with more than half from the prior is undetermined; the fit's value there says nothing.
// Named are the terms that move with it (correlation above a half): the prior's own, and those they trade places with.
#pragma once

#include <string>
#include <vector>

#include "solvers/covariance.h"
#include "solvers/prior.h"

namespace crumple {

struct Undetermined {
  std::string prior;                  // its name
  double prior_share = 0;             // of the information, above 0.5
  std::vector<std::string> terms;     // "cam0.k4", ...
  std::vector<std::string> partners;  // without a prior of their own: "cam0.k1", ...
};

// One entry per undetermined direction. Where a prior has more than three of them (the control points of a splined lens
// outside the images' reach), one entry lists the terms that the prior decides each for itself, and no partners.
std::vector<Undetermined> undetermined_terms(const std::vector<Prior>& priors, const JointCovariance& covariance,
                                             const CalibrationState& state);

}  // namespace crumple
