#include "calib/sphere_fit.h"

#include <algorithm>
#include <cmath>

#include "solvers/decompositions.h"

namespace crumple {
namespace {

constexpr int kSphereIterations = 50;
constexpr double kFlatPoints = 1e-12;  // of the smallest eigenvalue of the information scaled to a unit diagonal

Eigen::Vector3d average_of(const std::vector<Eigen::Vector3d>& points) {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& point : points) mean += point;
  return mean / static_cast<double>(points.size());
}

// About the origin, which is to be near the points.
Expected<Sphere> algebraic_sphere(const std::vector<Eigen::Vector3d>& points) {
  Eigen::Matrix4d information = Eigen::Matrix4d::Zero();
  Eigen::Vector4d right = Eigen::Vector4d::Zero();
  for (const Eigen::Vector3d& point : points) {
    const Eigen::Vector4d row(2 * point.x(), 2 * point.y(), 2 * point.z(), 1);
    information += row * row.transpose();
    right += row * point.squaredNorm();
  }
  const auto inverse = inverse_information(information, kFlatPoints);
  if (!inverse) return fail("the points lie on a plane or a circle, so no sphere is told");
  const Eigen::Vector4d solution = *inverse * right;
  Sphere sphere{solution.head<3>(), 0, 0};
  sphere.radius = std::sqrt(std::max(solution[3] + sphere.centre.squaredNorm(), 0.0));
  return sphere;
}

}  // namespace

Expected<Sphere> fit_sphere(const std::vector<Eigen::Vector3d>& points) {
  if (points.size() < 4) return fail("a sphere needs four points");
  const Eigen::Vector3d mean = average_of(points);
  std::vector<Eigen::Vector3d> about;
  for (const Eigen::Vector3d& point : points) about.push_back(point - mean);
  auto sphere = algebraic_sphere(about);
  for (int i = 0; sphere && i < kSphereIterations; ++i) {
    Eigen::Matrix4d information = Eigen::Matrix4d::Zero();
    Eigen::Vector4d right = Eigen::Vector4d::Zero();
    for (const Eigen::Vector3d& point : about) {
      Eigen::Vector4d row;
      row << (point - sphere->centre).normalized(), 1;
      information += row * row.transpose();
      right += row * sphere->distance(point);
    }
    const auto inverse = inverse_information(information, kFlatPoints);
    if (!inverse) return fail("the points are so flat that no sphere is told");
    const Eigen::Vector4d step = *inverse * right;
    sphere->centre += step.head<3>();
    sphere->radius += step[3];
    if (!step.allFinite() || !(sphere->radius > 0)) return fail("no sphere fits the points");
    if (step.norm() < 1e-12 * sphere->radius) break;
  }
  if (!sphere) return sphere;
  const Eigen::Vector3d axis = (average_of(about) - sphere->centre).normalized();
  for (const Eigen::Vector3d& point : about) {
    const double cosine = axis.dot((point - sphere->centre).normalized());
    sphere->cap_rad = std::max(sphere->cap_rad, std::acos(std::clamp(cosine, -1.0, 1.0)));
  }
  sphere->centre += mean;
  return sphere;
}

}  // namespace crumple
