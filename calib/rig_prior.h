// A rig with its covariance as what is known before a refinement: an earlier calibration told it, new observations may
// correct it, and neither is believed beyond its uncertainty.
//
// Sensors, LEDs and boards are matched by name. The prior is about those parameters that the observations touch,
// boards' scales among them, about what the given state has; the rest of the covariance (boards' warp, what is not in
// use) is left out of it, which is to be uncertain of it, not to hold it. What is to stay in the rig though nothing
// shows it is `carried`: the prior is about it too, and the refinement gives it what follows for it from the others.
// What the rig knows without a row in its covariance is exact: `held`. Sensors and LEDs that the rig does not have are
// neither: they are estimated from the observations alone.
#pragma once

#include <set>

#include "solvers/observations.h"
#include "solvers/prior.h"
#include "solvers/state.h"

namespace crumple {

constexpr const char* kRigPrior = "rig";  // the prior's name

struct RigPrior {
  CalibrationState state;  // the one given, with the rig's values
  Prior prior;
  std::set<BlockId> held;
  // Stations of a probe without sensors: its LEDs, which the rig knows, fix its frame, and no station need be held.
  std::set<BlockId> freed = {};
};

// Fails on a rig without a covariance, on a sensor with another lens model or mount than the rig's, where another
// sensor than the rig's is the first on its mount (whose frame is then another), and on a covariance that is not
// positive definite.
// Of `unknown` blocks the rig is taken to know nothing.
Expected<RigPrior> rig_prior(const Rig& rig, const CalibrationState& state, const Observations& observations,
                             const std::set<BlockId>& unknown = {}, const std::set<BlockId>& carried = {});

}  // namespace crumple
