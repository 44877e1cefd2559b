#include "datasets/render/box.h"

#include <algorithm>
#include <limits>
#include <utility>

namespace crumple {

std::optional<double> entry(const Box& box, const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) {
  double enters = 0;
  double leaves = std::numeric_limits<double>::infinity();
  for (int axis = 0; axis < 3; ++axis) {
    const double half = box.size_mm[axis] / 2;
    if (direction[axis] == 0) {
      if (std::abs(origin[axis]) > half) return std::nullopt;
      continue;
    }
    const double a = (-half - origin[axis]) / direction[axis];
    const double b = (half - origin[axis]) / direction[axis];
    enters = std::max(enters, std::min(a, b));
    leaves = std::min(leaves, std::max(a, b));
  }
  if (enters > leaves) return std::nullopt;
  return enters;
}

bool contains(const Box& box, const Eigen::Vector3d& point) {
  const Eigen::Vector3d inside = box.mount_from_box.inverse() * point;
  return (inside.cwiseAbs().array() < box.size_mm.array() / 2).all();
}

bool stands_between(const Box& box, const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  const Pose box_from_mount = box.mount_from_box.inverse();
  const Eigen::Vector3d origin = box_from_mount * a;
  const auto t = entry(box, origin, box_from_mount * b - origin);
  return t && *t < 1;
}

}  // namespace crumple
