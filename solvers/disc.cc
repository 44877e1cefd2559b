#include "solvers/disc.h"

#include <cmath>
#include <cstddef>
#include <numbers>

namespace crumple {
namespace {

constexpr std::size_t kCount = kDiscVertices;

double cross(const Eigen::Vector2d& a, const Eigen::Vector2d& b) { return a.x() * b.y() - a.y() * b.x(); }

}  // namespace

DiscOutline disc_outline(double radius) {
  // The polar moment over the area is R^2 (2 + cos(2 pi / n)) / 6 of a regular polygon, r^2 / 2 of a disc.
  const double step = 2 * std::numbers::pi / kDiscVertices;
  const double outer = radius * std::sqrt(3 / (2 + std::cos(step)));
  DiscOutline outline;
  for (std::size_t i = 0; i < kCount; ++i) {
    const double angle = step * static_cast<double>(i);
    outline[i] = outer * Eigen::Vector2d(std::cos(angle), std::sin(angle));
  }
  return outline;
}

Eigen::Vector2d centroid(const DiscOutline& outline) {
  // Relative to a vertex: the products of image coordinates would lose digits.
  const Eigen::Vector2d origin = outline[0];
  double twice_area = 0;
  Eigen::Vector2d moment = Eigen::Vector2d::Zero();
  for (std::size_t i = 0; i < kCount; ++i) {
    const Eigen::Vector2d a = outline[i] - origin, b = outline[(i + 1) % kCount] - origin;
    twice_area += cross(a, b);
    moment += cross(a, b) * (a + b);
  }
  return origin + moment / (3 * twice_area);
}

CentroidDerivative centroid_with_derivative(const DiscOutline& outline) {
  // With c = M / (3 S): dc = (dM - 3 c dS) / (3 S), everything about the centroid, where c = 0.
  CentroidDerivative result;
  result.centroid = centroid(outline);
  DiscOutline about;
  for (std::size_t i = 0; i < kCount; ++i) about[i] = outline[i] - result.centroid;
  double twice_area = 0;
  for (std::size_t i = 0; i < kCount; ++i) twice_area += cross(about[i], about[(i + 1) % kCount]);
  for (std::size_t i = 0; i < kCount; ++i) {
    const Eigen::Vector2d& before = about[(i + kCount - 1) % kCount];
    const Eigen::Vector2d& here = about[i];
    const Eigen::Vector2d& after = about[(i + 1) % kCount];
    // d cross(here, after) / d here = (after.y, -after.x); d cross(before, here) / d here = (-before.y, before.x).
    const Eigen::RowVector2d d_after(after.y(), -after.x()), d_before(-before.y(), before.x());
    const Eigen::Matrix2d d_moment = (here + after) * d_after + (before + here) * d_before +
                                     (cross(here, after) + cross(before, here)) * Eigen::Matrix2d::Identity();
    result.d_vertex[i] = d_moment / (3 * twice_area);
  }
  return result;
}

}  // namespace crumple
