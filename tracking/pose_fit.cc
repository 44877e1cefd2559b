#include "tracking/pose_fit.h"

#include <cmath>
#include <limits>

#include <Eigen/Cholesky>

#include "solvers/decompositions.h"

namespace crumple {
namespace {

constexpr double kNoRedundancy = 1e-3;
constexpr double kSingularPose = 1e-12;  // of the smallest eigenvalue of the information scaled to a unit diagonal

struct PoseEquations {
  Matrix6d information = Matrix6d::Zero();
  Vector6d gradient = Vector6d::Zero();
  double cost = 0;
};

bool pose_equations(const std::vector<LedSighting>& sightings, const std::vector<char>& used, const Pose& pose,
                    const std::optional<double>& cauchy_scale, PoseEquations& sum) {
  sum = {};
  SightingResidual at;
  for (std::size_t i = 0; i < sightings.size(); ++i) {
    if (!used[i]) continue;
    if (!evaluate(sightings[i], pose, at)) return false;
    const Eigen::Matrix<double, 6, 2> weighted = at.d_pose.transpose() * sightings[i].information;
    const double square = at.residual_px.dot(sightings[i].information * at.residual_px);
    const double c2 = cauchy_scale ? *cauchy_scale * *cauchy_scale : 0;
    const double weight = cauchy_scale ? 1 / (1 + square / c2) : 1;
    sum.information += weight * weighted * at.d_pose;
    sum.gradient += weight * weighted * at.residual_px;
    sum.cost += cauchy_scale ? c2 * std::log1p(square / c2) : square;
  }
  return std::isfinite(sum.cost);
}

}  // namespace

std::optional<PoseFit> fit_pose(const std::vector<LedSighting>& sightings, const std::vector<char>& used,
                                const Pose& start, const PoseFitOptions& options) {
  PoseFit fit{.world_from_probe = start};
  PoseEquations at, next;
  if (!pose_equations(sightings, used, start, options.cauchy_scale, at)) return std::nullopt;
  double damping = 0;
  for (; fit.iterations < options.max_iterations; ++fit.iterations) {
    Matrix6d damped = at.information;
    damped.diagonal() *= 1 + damping;
    const Vector6d step = -solve_symmetric(damped, at.gradient);
    if (!step.allFinite()) break;
    const Pose moved = retract(fit.world_from_probe, step);
    // Where the linearised sum has no more to gain, the rest is rounding.
    const bool done = -step.dot(at.gradient) <= 1e-10 * (1e-6 + at.cost);
    if (pose_equations(sightings, used, moved, options.cauchy_scale, next) && next.cost <= at.cost) {
      fit.world_from_probe = moved;
      at = next;
      damping = damping < 1e-6 ? 0 : damping / 10;
    } else {
      if (done || damping > 1e8) break;
      damping = damping > 0 ? 10 * damping : 1e-3;
      continue;
    }
    if (done) break;
  }
  fit.cost = at.cost;
  const auto covariance = inverse_information(at.information, kSingularPose);
  if (!covariance) return std::nullopt;
  fit.covariance = *covariance;
  return fit;
}

double standardised_square(const LedSighting& sighting, bool used, const PoseFit& fit) {
  SightingResidual at;
  if (!evaluate(sighting, fit.world_from_probe, at)) return std::numeric_limits<double>::infinity();
  // In units of the pixel's own sigmas.
  const Eigen::Matrix2d root = sighting.covariance_px2.llt().matrixL();
  const Eigen::Vector2d r = root.triangularView<Eigen::Lower>().solve(at.residual_px);
  const Matrix2x6d jacobian = root.triangularView<Eigen::Lower>().solve(at.d_pose);
  const Eigen::Matrix2d of_pose = jacobian * fit.covariance * jacobian.transpose();
  const Eigen::Matrix2d variance = Eigen::Matrix2d::Identity() + (used ? -1 : 1) * of_pose;
  const SymmetricEigen2 eigen = symmetric_eigen2(variance);
  double square = 0;
  for (int i = 0; i < 2; ++i) {
    const double along = eigen.vectors.col(i).dot(r);
    if (eigen.values[i] > kNoRedundancy) square += along * along / eigen.values[i];
  }
  return square;
}

}  // namespace crumple
