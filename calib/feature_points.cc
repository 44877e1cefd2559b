#include "calib/feature_points.h"

#include <cmath>
#include <numbers>

#include <fmt/format.h>

#include "calib/sphere_fit.h"

namespace crumple {
namespace {

constexpr std::size_t kLeastSpherePoints = 50;
constexpr double kFirstBand = 0.25;  // of the radius, to either side of the surface
constexpr double kLastBand = 0.02;
constexpr double kRadiusTolerance = 0.1;
constexpr double kLeastCap_rad = 25 * std::numbers::pi / 180;

template <typename Inside>
std::vector<std::size_t> points_where(const Cloud& cloud, const Inside& inside) {
  std::vector<std::size_t> found;
  for (std::size_t i = 0; i < cloud.points.size(); ++i) {
    if (cloud.points[i].quality > 0 && inside(cloud.points[i].position_mm)) found.push_back(i);
  }
  return found;
}

}  // namespace

std::vector<std::size_t> points_within(const Cloud& cloud, const Eigen::Vector3d& place_mm, double radius_mm) {
  return points_where(cloud, [&](const Eigen::Vector3d& x) { return (x - place_mm).norm() <= radius_mm; });
}

std::vector<std::size_t> points_within(const Cloud& cloud, const Eigen::AlignedBox3d& box_mm) {
  return points_where(cloud, [&](const Eigen::Vector3d& x) { return box_mm.contains(x); });
}

Expected<std::vector<std::size_t>> points_on_sphere(const Cloud& cloud, const Eigen::Vector3d& near_mm,
                                                    double radius_mm) {
  Sphere sphere{near_mm, radius_mm, 0};
  std::vector<std::size_t> found;
  for (double band = kFirstBand;; band = std::max(band / 2, kLastBand)) {
    found =
        points_where(cloud, [&](const Eigen::Vector3d& x) { return std::abs(sphere.distance(x)) <= band * radius_mm; });
    if (found.size() < kLeastSpherePoints) {
      return fail(fmt::format("only {} points lie near a sphere of radius {} mm there", found.size(), radius_mm));
    }
    std::vector<Eigen::Vector3d> positions;
    for (const std::size_t i : found) positions.push_back(cloud.points[i].position_mm);
    const auto fitted = fit_sphere(positions);
    if (!fitted) return tl::unexpected(fitted.error());
    sphere = *fitted;
    if (std::abs(sphere.radius - radius_mm) > kRadiusTolerance * radius_mm) {
      return fail(fmt::format("the sphere that fits has a radius of {:.2f} mm, not {} mm", sphere.radius, radius_mm));
    }
    if (band == kLastBand) break;
  }
  if (sphere.cap_rad < kLeastCap_rad) {
    return fail(
        fmt::format("only a cap of {:.0f} degrees about its axis was seen, which tells no centre: 25 are needed, so "
                    "measure it from more sides",
                    sphere.cap_rad * 180 / std::numbers::pi));
  }
  return found;
}

}  // namespace crumple
