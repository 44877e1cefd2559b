// The sphere that fits points best, its radius free: least squares of the distances from its surface, as VDI/VDE 2634
// has it.
//
// Start: the algebraic fit |X|^2 = 2 c . X + (r^2 - |c|^2), linear in c and in the bracket; then Gauss-Newton.
//
// A cap says little of where its sphere's centre is along the cap's axis: there centre and radius nearly compensate
// each other, and noise makes the radius too small by sigma^2 / r times a factor that grows with the fourth power of
// the cap's narrowness. `cap_rad` says how much of the sphere was seen: the largest angle between a point and the mean
// direction of all, as seen from the centre; a hemisphere has 90 degrees.
#pragma once

#include <vector>

#include <Eigen/Core>

#include "solvers/expected.h"

namespace crumple {

struct Sphere {
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  double radius = 0;
  double cap_rad = 0;

  // Outside positive.
  double distance(const Eigen::Vector3d& x) const { return (x - centre).norm() - radius; }
};

// Fails with fewer than four points, where they lie on a plane, and where no sphere is found.
Expected<Sphere> fit_sphere(const std::vector<Eigen::Vector3d>& points);

}  // namespace crumple
