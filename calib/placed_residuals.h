// Every residual of a calibration, where it lies in the image of the sensor whose noise it carries.
//
// Pixels and residuals are px, residuals predicted minus measured. Corners, features and LEDs lie at their camera pixel
// and have two coordinates. A stripe reading has one, along its stripes' normal in the projector's pixel plane; it lies
// at the projector pixel that the board reflects to its camera pixel (solvers/transfer.h). One whose place the
// calibration cannot predict (it was left out, and its ray misses the board) is not among them.
#pragma once

#include <optional>
#include <vector>

#include <Eigen/Core>

#include "solvers/bundle.h"

namespace crumple {

struct PlacedResidual {
  Eigen::Vector2d pixel;
  Eigen::Vector2d residual_px;            // of a stripe reading along its normal
  std::optional<Eigen::Vector2d> normal;  // unit; where only the coordinate along it was measured
  double sigma_px = 0;                    // of one coordinate, its group's
  bool accepted = true;
  View::Kind kind = View::Kind::corners;
};

// One list per sensor, views in their order. `observations` are those that the bundle was refined with.
std::vector<std::vector<PlacedResidual>> placed_residuals(const Observations& observations, const BundleResult& bundle);

}  // namespace crumple
