// The plane that fits points best (orthogonal least squares), and how far the points lie from it.
#pragma once

#include <vector>

#include <Eigen/Core>

#include "solvers/expected.h"

namespace crumple {

struct Plane {
  Eigen::Vector3d point = Eigen::Vector3d::Zero();
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();

  double distance(const Eigen::Vector3d& x) const { return normal.dot(x - point); }
};

// Fails with fewer than three points, and where they lie on a line.
Expected<Plane> fit_plane(const std::vector<Eigen::Vector3d>& points);

// The same after leaving out, thrice, what lies beyond `gate` robust sigmas (1.4826 median absolute distances).
struct RobustPlane {
  Plane plane;
  double rms_mm = 0;            // of the points kept
  double trimmed_share = 0;     // of all points
  double rms_untrimmed_mm = 0;  // of all points about the plane that fits all of them
};
Expected<RobustPlane> fit_plane_robustly(const std::vector<Eigen::Vector3d>& points, double gate);

}  // namespace crumple
