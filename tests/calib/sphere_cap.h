// Points of a sphere as a probe at a station sees it.
#pragma once

#include <cmath>
#include <cstdint>
#include <numbers>
#include <vector>

#include "recon/cloud.h"
#include "solvers/pose.h"

namespace crumple {

// The side that faces the probe, in the world, up to an angle from the line of sight.
inline std::vector<Eigen::Vector3d> sphere_cap(const Pose& world_from_probe, const Eigen::Vector3d& centre_in_probe,
                                               double radius_mm, double reach_rad, int rings) {
  const Eigen::Vector3d towards = -centre_in_probe.normalized();
  const Eigen::Vector3d across = towards.unitOrthogonal(), up = towards.cross(across);
  std::vector<Eigen::Vector3d> points;
  for (int ring = 0; ring <= rings; ++ring) {
    const double tilt = reach_rad * ring / rings;
    for (int k = 0; k < std::max(1, 6 * ring); ++k) {
      const double turn = 2 * std::numbers::pi * k / std::max(1, 6 * ring);
      const Eigen::Vector3d normal =
          std::cos(tilt) * towards + std::sin(tilt) * (std::cos(turn) * across + std::sin(turn) * up);
      points.push_back(world_from_probe * (centre_in_probe + radius_mm * normal));
    }
  }
  return points;
}

// With a covariance along the ray from the probe, of one view.
inline void add_points(const std::vector<Eigen::Vector3d>& positions, std::uint16_t view, const Pose& world_from_probe,
                       double sigma_mm, Cloud& cloud) {
  for (const Eigen::Vector3d& position : positions) {
    CloudPoint point;
    point.position_mm = position;
    const Eigen::Vector3d ray = (position - world_from_probe.translation).normalized();
    point.normal = -ray.cast<float>();
    point.covariance_mm2 = (sigma_mm * sigma_mm * ray * ray.transpose()).cast<float>();
    point.view = view;
    point.quality = 1;
    cloud.points.push_back(point);
  }
}

}  // namespace crumple
