#include "solvers/gate.h"

#include <cmath>
#include <numbers>

#include <Eigen/Eigenvalues>
#include <Eigen/LU>

namespace crumple {

double gate_for(int dimension, double gate) {
  if (dimension == 2) return gate;
  // P(|z| > t) = erfc(t / sqrt 2) = exp(-gate / 2), by bisection.
  const double probability = std::exp(-gate / 2);
  double low = 0, high = std::sqrt(gate);
  for (int i = 0; i < 60; ++i) {
    const double middle = 0.5 * (low + high);
    (std::erfc(middle / std::numbers::sqrt2) > probability ? low : high) = middle;
  }
  return low * low;
}

double kept_variance(int dimension, double gate) {
  const double outside = std::exp(-gate / 2);
  if (dimension == 2) return 1 - 0.5 * gate * outside / (1 - outside);
  const double t = std::sqrt(gate_for(1, gate));
  const double density = std::exp(-t * t / 2) / std::sqrt(2 * std::numbers::pi);
  return 1 - 2 * t * density / (1 - outside);
}

StandardisedSquare standardised_square(const Eigen::VectorXd& whitened, const Eigen::Matrix2d& hat, bool inlier,
                                       bool dispensable) {
  constexpr double kTestable = 1e-6;  // of the redundancy's determinant
  const int d = static_cast<int>(whitened.size());
  // In one dimension the second row stands idle: residual 0, variance 1.
  Eigen::Vector2d residual = Eigen::Vector2d::Zero();
  residual.head(d) = whitened;
  const Eigen::Matrix2d variance = Eigen::Matrix2d::Identity() + (inlier ? -1 : 1) * hat;
  if (variance.determinant() >= kTestable) return {residual.dot(variance.inverse() * residual), d};
  // Of a point that is read twice, both readings have redundancy across their epipolar lines; there is no telling which
  // of them is wrong, so that is looked at only where both can be spared.
  if (!dispensable) return {0, d};
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> axes(variance);
  if (axes.eigenvalues()[1] < std::sqrt(kTestable)) return {0, d};
  const double along = axes.eigenvectors().col(1).dot(residual);
  return {along * along / axes.eigenvalues()[1], 1};
}

}  // namespace crumple
