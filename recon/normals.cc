#include "recon/normals.h"

#include <cmath>
#include <optional>

#include <Eigen/Geometry>

namespace crumple {
namespace {

std::optional<Eigen::Vector3d> point_at(const cv::Mat& depth_mm, const RayTable& rays, int x, int y) {
  if (x < 0 || y < 0 || x >= depth_mm.cols || y >= depth_mm.rows) return std::nullopt;
  const double depth = depth_mm.at<double>(y, x);
  if (depth <= 0) return std::nullopt;
  return depth * rays.at(x, y);
}

}  // namespace

Eigen::Vector3d grid_normal(const cv::Mat& depth_mm, const RayTable& rays, int x, int y, double largest_slope) {
  constexpr int kReach = 2;
  const auto centre = point_at(depth_mm, rays, x, y);
  if (!centre) return Eigen::Vector3d::Zero();
  const auto tangent = [&](int dx, int dy) -> std::optional<Eigen::Vector3d> {
    const auto before = point_at(depth_mm, rays, x - dx, y - dy);
    const auto after = point_at(depth_mm, rays, x + dx, y + dy);
    if (!before && !after) return std::nullopt;
    const Eigen::Vector3d t = after.value_or(*centre) - before.value_or(*centre);
    if (std::abs(t.z()) > largest_slope * t.head<2>().norm()) return std::nullopt;
    return t;
  };
  const auto along_x = tangent(kReach, 0);
  const auto along_y = tangent(0, kReach);
  if (!along_x || !along_y) return Eigen::Vector3d::Zero();
  const Eigen::Vector3d normal = along_x->cross(*along_y);
  const double length = normal.norm();
  if (!(length > 0)) return Eigen::Vector3d::Zero();
  return normal.dot(*centre) > 0 ? Eigen::Vector3d(-normal / length) : Eigen::Vector3d(normal / length);
}

}  // namespace crumple
