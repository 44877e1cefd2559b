// A rig with its covariance as what is known before a refinement: an earlier calibration told it, new observations may
// correct it, and neither is believed beyond its uncertainty.
//
// Sensors and LEDs are matched by name. The prior is about those parameters that the observations touch; the rest of
// the covariance (boards, sensors that are not used) is left out of it, which is to be uncertain of them, not to hold
// them. What the rig knows without a row in its covariance is exact: `held`. Sensors and LEDs that the rig does not
// have are neither: they are estimated from the observations alone.
#pragma once

#include <set>

#include "solvers/observations.h"
#include "solvers/prior.h"
#include "solvers/state.h"

namespace crumple {

struct RigPrior {
  CalibrationState state;  // the one given, with the rig's values
  Prior prior;
  std::set<BlockId> held;
};

// Fails on a rig without a covariance, on a sensor with another lens model or mount than the rig's, where another
// sensor than the rig's is the first on its mount (whose frame is then another), and on a covariance that is not
// positive definite.
Expected<RigPrior> rig_prior(const Rig& rig, const CalibrationState& state, const Observations& observations);

}  // namespace crumple
