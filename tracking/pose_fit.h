// Least squares of the probe's pose over LED sightings, from a start: Gauss-Newton, damped where a full step would not
// lower the sum.
#pragma once

#include <optional>
#include <vector>

#include "tracking/led_sighting.h"

namespace crumple {

struct PoseFit {
  Pose world_from_probe;
  Matrix6d covariance = Matrix6d::Zero();  // inverse information of the sightings used
  double cost = 0;                         // what was minimised
  int iterations = 0;
};

struct PoseFitOptions {
  // Tames large residuals by the Cauchy loss c^2 log(1 + r^2 / c^2), r in sigmas; none: least squares.
  std::optional<double> cauchy_scale = {};
  int max_iterations = 50;
};

// `used` has one entry per sighting. No value where an LED has no pixel at the start or the information is singular.
std::optional<PoseFit> fit_pose(const std::vector<LedSighting>& sightings, const std::vector<char>& used,
                                const Pose& start, const PoseFitOptions& options = {});

// The squared residual of a sighting over the variance that it should have: of one that was used, less than the pixel's
// own by what it drew the pose to itself; of one left out, more by the pose's. Directions in which a sighting decides
// the pose alone say nothing and do not count. Infinite where there is no pixel.
double standardised_square(const LedSighting& sighting, bool used, const PoseFit& fit);

}  // namespace crumple
