// An estimated rig against a known one, parameter by parameter and in units of the predicted sigma.
#pragma once

#include <string>
#include <vector>

#include "solvers/expected.h"
#include "solvers/rig.h"

namespace crumple {

struct ParameterTruth {
  std::string name;  // as in RigCovariance, such as "cam0.fx"
  double estimate = 0;
  double truth = 0;
  double error =
      0;  // estimate - truth; of a mount the step from the truth to the estimate (local_step, solvers/pose.h)
  double sigma = 0;  // predicted
  double z = 0;      // error / sigma
};

// Every lens and mount parameter that has a row in the estimate's covariance, in its order; the board's warp is no part
// of a rig. Mounts are relative to the estimate's first sensor: rotation vector in rad, translation in mm. Fails where
// the truth lacks a sensor or has another lens model there.
Expected<std::vector<ParameterTruth>> compare_with_true_rig(const Rig& estimated, const Rig& truth);

}  // namespace crumple
