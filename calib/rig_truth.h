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

struct RigTruth {
  std::vector<ParameterTruth> parameters;
  // Sensors and LEDs that the truth does not know, such as a tracker where it was moved to, or that have no frame in
  // common with it.
  std::vector<std::string> not_compared;
};

// Every lens and mount parameter that has a row in the estimate's covariance, in its order, and every LED; the board's
// warp is no part of a rig. Mounts are relative to the first sensor on the same mount: rotation vector in rad,
// translation in mm. Fails where the truth knows no sensor of the estimate, or has another lens model for one.
Expected<RigTruth> compare_with_true_rig(const Rig& estimated, const Rig& truth);

// How far a lens is off: the RMS over the image, px, between where it and the true one see the rays of a grid of
// pixels, after the rotation that fits them best, which is the mount's affair.
Expected<double> lens_error_px(const Lens& estimated, const Lens& truth);

// How far hand and eye are off: the rigid motion that carries the probe's true LEDs onto the estimated ones, both in
// the frame of the first sensor on the probe.
struct HandEyeError {
  double translation_mm = 0;  // of the LEDs' middle
  double rotation_rad = 0;
};
// Fails with fewer than three LEDs in common.
Expected<HandEyeError> hand_eye_error(const Rig& estimated, const Rig& truth);

}  // namespace crumple
