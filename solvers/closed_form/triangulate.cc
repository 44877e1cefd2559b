#include "solvers/closed_form/triangulate.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include <Eigen/Cholesky>
#include <fmt/format.h>

#include "solvers/decompositions.h"

namespace crumple {
namespace {

constexpr double kParallelRays = 1e-12;  // of the smallest eigenvalue per ray: the square of half an angle of 2e-6 rad
constexpr double kUncertainShare = 0.25;
constexpr int kMaxPointSteps = 30;

struct PointEquations {
  Eigen::Matrix3d information = Eigen::Matrix3d::Zero();
  Eigen::Vector3d gradient = Eigen::Vector3d::Zero();
  double chi_square = 0;
};

// No value where a sensor does not project the point.
std::optional<PointEquations> point_equations(const std::vector<Sighting>& sightings,
                                              const std::vector<Eigen::Matrix2d>& weights,
                                              const Eigen::Vector3d& point_mm) {
  PointEquations sum;
  std::vector<double> d_u, d_v;
  for (std::size_t i = 0; i < sightings.size(); ++i) {
    const Sighting& s = sightings[i];
    d_u.resize(static_cast<std::size_t>(s.lens->parameter_count()));
    d_v.resize(d_u.size());
    Eigen::Vector2d pixel;
    Matrix2x3d d_point;
    if (!s.lens->project_into(s.sensor_from_world * point_mm, pixel, d_point, d_u.data(), d_v.data())) {
      return std::nullopt;
    }
    const Matrix2x3d jacobian = d_point * s.sensor_from_world.rotation.toRotationMatrix();
    const Eigen::Vector2d residual = pixel - s.pixel;
    sum.information += jacobian.transpose() * weights[i] * jacobian;
    sum.gradient += jacobian.transpose() * weights[i] * residual;
    sum.chi_square += residual.dot(weights[i] * residual);
  }
  return sum;
}

double nearest_distance_mm(const std::vector<Sighting>& sightings, const Eigen::Vector3d& point_mm) {
  double distance = std::numeric_limits<double>::infinity();
  for (const Sighting& s : sightings) distance = std::min(distance, (s.sensor_from_world * point_mm).norm());
  return distance;
}

}  // namespace

Expected<Eigen::Vector3d> nearest_to_rays(const std::vector<Eigen::Vector3d>& origins,
                                          const std::vector<Eigen::Vector3d>& directions) {
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < origins.size(); ++i) {
    const Eigen::Matrix3d across = Eigen::Matrix3d::Identity() - directions[i] * directions[i].transpose();
    sum += across;
    right += across * origins[i];
  }
  const SymmetricEigen3 eigen = symmetric_eigen3(sum);
  const double smallest = eigen.values[0];
  if (origins.size() < 2 || !(smallest > kParallelRays * static_cast<double>(origins.size()))) {
    return fail("the rays are parallel, so they meet nowhere: look from sensors that stand further apart");
  }
  return Eigen::Vector3d(eigen.vectors *
                         (eigen.values.cwiseInverse().asDiagonal() * (eigen.vectors.transpose() * right)));
}

Expected<TriangulatedPoint> triangulate(const std::vector<Sighting>& sightings) {
  if (sightings.size() < 2) return fail("a point in space needs the pixels of at least two sensors");
  std::vector<Eigen::Vector3d> origins, directions;
  std::vector<Eigen::Matrix2d> weights;
  for (std::size_t i = 0; i < sightings.size(); ++i) {
    const Sighting& s = sightings[i];
    const auto ray = s.lens->ray(s.pixel);
    if (!ray) return fail(fmt::format("sighting {} has a pixel outside its lens's domain", i));
    const Pose world_from_sensor = s.sensor_from_world.inverse();
    origins.push_back(world_from_sensor.translation);
    directions.push_back((world_from_sensor.rotation * *ray).normalized());
    weights.push_back(s.covariance_px2.inverse());
    if (!weights.back().allFinite()) return fail(fmt::format("sighting {} has no sound covariance", i));
  }
  const auto start = nearest_to_rays(origins, directions);
  if (!start) return tl::unexpected(start.error());
  TriangulatedPoint result{.point_mm = *start};
  auto at = point_equations(sightings, weights, result.point_mm);
  if (!at) return fail("the rays meet behind a sensor: one of the pixels is of something else");
  for (int step = 0; step < kMaxPointSteps; ++step) {
    const Eigen::Vector3d move = -at->information.ldlt().solve(at->gradient);
    if (!move.allFinite()) break;
    const auto next = point_equations(sightings, weights, result.point_mm + move);
    // Where a full step raises the sum the start is as good as rounding lets it be, or the rays barely meet.
    if (!next || next->chi_square > at->chi_square) break;
    const double gained = at->chi_square - next->chi_square;
    result.point_mm += move;
    at = next;
    if (gained <= 1e-12 * (1e-12 + at->chi_square)) break;
  }
  result.chi_square = at->chi_square;
  const SymmetricEigen3 eigen = symmetric_eigen3(at->information);
  const double distance_mm = nearest_distance_mm(sightings, result.point_mm);
  const double largest_variance = 1 / eigen.values[0];
  if (!(largest_variance > 0 && std::sqrt(largest_variance) < kUncertainShare * distance_mm)) {
    return fail(
        "the rays are so nearly parallel for the uncertainty of the pixels that the point's distance is open: look "
        "from sensors that stand further apart");
  }
  result.covariance_mm2 = eigen.vectors * eigen.values.cwiseInverse().asDiagonal() * eigen.vectors.transpose();
  return result;
}

}  // namespace crumple
