// One made camera-projector rig with board placements, for every solver test: truth and the observations it implies.
#pragma once

#include <random>

#include "solvers/observations.h"
#include "solvers/state.h"

namespace crumple {

struct SyntheticOptions {
  int placements = 8;
  double corner_sigma_px = 0;
  double stripe_sigma_px = 0;
  double feature_sigma_px = 0;
  unsigned seed = 1;
  const char* model = "LENSMODEL_OPENCV5";
  Eigen::Vector2d projector_principal_point{512, 850};  // below the panel: an offset lens
  Eigen::Vector2d warp_mm{0, 0};
  double disc_radius_mm = 0;  // above 0: the board carries discs
};

struct Synthetic {
  CalibrationState truth;
  Observations observations;
};

Synthetic make_synthetic(const SyntheticOptions& options);

// The truth pushed away, as a start for refinement.
CalibrationState disturbed(const CalibrationState& truth, unsigned seed);

}  // namespace crumple
