// Clouds of surfaces as a camera would see them, with noise along its rays.
#pragma once

#include <random>
#include <string>

#include "recon/cloud.h"

namespace crumple {

// The height z(x, y) over a square of 2 * half_mm at a pitch, seen by a camera at `viewer_mm`; points are where its
// rays meet the surface, moved along them by noise of sigma_mm.
template <typename Height>
Cloud made_surface(const Height& height_mm, double half_mm, double pitch_mm, const Eigen::Vector3d& viewer_mm,
                   double sigma_mm, unsigned seed, const std::string& station = "a") {
  std::mt19937_64 generator(seed);
  std::normal_distribution<double> noise(0, 1);
  Cloud cloud;
  cloud.frame = "world";
  cloud.stations = {station};
  const int steps = static_cast<int>(half_mm / pitch_mm);
  for (int row = -steps; row <= steps; ++row) {
    for (int column = -steps; column <= steps; ++column) {
      const double x = column * pitch_mm, y = row * pitch_mm;
      const Eigen::Vector3d place(x, y, height_mm(x, y));
      const Eigen::Vector3d ray = (place - viewer_mm).normalized();
      CloudPoint point;
      point.position_mm = place + sigma_mm * noise(generator) * ray;
      point.normal = {0, 0, 1};
      point.sigma_mm = static_cast<float>(sigma_mm);
      point.covariance_mm2 = (sigma_mm * sigma_mm * ray * ray.transpose()).cast<float>();
      point.quality = 1;
      cloud.points.push_back(point);
    }
  }
  return cloud;
}

inline double flat(double, double) { return 0; }

}  // namespace crumple
