// A point in the world from the pixels at which two or more sensors see it.
//
// Start: the point with the least sum of squared distances to the rays, a linear problem (Hartley & Sturm,
// Triangulation, CVIU 1997, call it the midpoint for two rays). Then Gauss-Newton on the whitened residuals of
// reprojection, predicted minus measured px. World frame, mm; the covariance follows from that of the pixels, the
// sensors being exact.
//
// Refused by name: one sensor only; rays that are parallel, or so nearly for the pixels' sigmas that the point's
// distance is uncertain by more than a quarter of itself; rays that meet behind a sensor; pixels without a ray.
#pragma once

#include <vector>

#include <Eigen/Core>

#include "solvers/expected.h"
#include "solvers/lens.h"
#include "solvers/pose.h"

namespace crumple {

// What one sensor sees of the point.
struct Sighting {
  const Lens* lens = nullptr;
  Pose sensor_from_world;
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();
  Eigen::Matrix2d covariance_px2 = Eigen::Matrix2d::Identity();
};

struct TriangulatedPoint {
  Eigen::Vector3d point_mm = Eigen::Vector3d::Zero();
  Eigen::Matrix3d covariance_mm2 = Eigen::Matrix3d::Zero();
  double chi_square = 0;  // of 2 n - 3 degrees of freedom for n sensors
};

Expected<TriangulatedPoint> triangulate(const std::vector<Sighting>& sightings);

// The linear start alone: the point nearest to the rays from `origins` along `directions` (unit vectors).
Expected<Eigen::Vector3d> nearest_to_rays(const std::vector<Eigen::Vector3d>& origins,
                                          const std::vector<Eigen::Vector3d>& directions);

}  // namespace crumple
