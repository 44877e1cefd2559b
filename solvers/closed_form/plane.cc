#include "solvers/closed_form/plane.h"

#include <algorithm>
#include <cmath>

#include "solvers/decompositions.h"

namespace crumple {
namespace {

constexpr int kTrims = 3;

double rms(const Plane& plane, const std::vector<Eigen::Vector3d>& points) {
  double sum = 0;
  for (const Eigen::Vector3d& p : points) sum += plane.distance(p) * plane.distance(p);
  return std::sqrt(sum / static_cast<double>(points.size()));
}

double robust_sigma(const Plane& plane, const std::vector<Eigen::Vector3d>& points) {
  std::vector<double> distances;
  for (const Eigen::Vector3d& p : points) distances.push_back(std::abs(plane.distance(p)));
  const auto middle = distances.begin() + static_cast<std::ptrdiff_t>(distances.size() / 2);
  std::nth_element(distances.begin(), middle, distances.end());
  return 1.4826 * *middle;
}

}  // namespace

Expected<Plane> fit_plane(const std::vector<Eigen::Vector3d>& points) {
  if (points.size() < 3) return fail("a plane needs at least three points");
  Plane plane;
  for (const Eigen::Vector3d& p : points) plane.point += p;
  plane.point /= static_cast<double>(points.size());
  Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
  for (const Eigen::Vector3d& p : points) scatter += (p - plane.point) * (p - plane.point).transpose();
  const SymmetricEigen3 eigen = symmetric_eigen3(scatter);
  if (!(eigen.values[1] > 1e-12 * eigen.values[2])) return fail("the points lie on a line, not on a plane");
  plane.normal = eigen.vectors.col(0);
  return plane;
}

Expected<RobustPlane> fit_plane_robustly(const std::vector<Eigen::Vector3d>& points, double gate) {
  auto plane = fit_plane(points);
  if (!plane) return tl::unexpected(plane.error());
  RobustPlane result;
  result.rms_untrimmed_mm = rms(*plane, points);
  std::vector<Eigen::Vector3d> kept = points;
  for (int i = 0; i < kTrims; ++i) {
    const double limit = gate * robust_sigma(*plane, points);
    kept.clear();
    std::copy_if(points.begin(), points.end(), std::back_inserter(kept),
                 [&](const Eigen::Vector3d& p) { return std::abs(plane->distance(p)) <= limit; });
    plane = fit_plane(kept);
    if (!plane) return tl::unexpected(plane.error());
  }
  result.plane = *plane;
  result.rms_mm = rms(*plane, kept);
  result.trimmed_share = 1 - static_cast<double>(kept.size()) / static_cast<double>(points.size());
  return result;
}

}  // namespace crumple
