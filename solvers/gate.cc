#include "solvers/gate.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include <Eigen/Eigenvalues>
#include <Eigen/LU>

#include "solvers/distribution_tails.h"

namespace crumple {

double gate_for(int dimension, double gate, double freedom) {
  // P(F > x / 2) = (1 + x / freedom)^(-freedom / 2) of two degrees over `freedom`.
  const double in_two = std::isinf(freedom) ? gate : freedom * std::expm1(gate / freedom);
  if (dimension == 2) return in_two;
  const double probability = std::exp(-gate / 2);
  double low = 0, high = in_two;
  for (int i = 0; i < 60; ++i) {
    const double middle = 0.5 * (low + high);
    (f_tail(middle, 1, freedom) > probability ? low : high) = middle;
  }
  return low;
}

double without_itself(double square, double own_square, double own_freedom, double freedom) {
  if (std::isinf(freedom)) return square;
  if (!(own_square < freedom)) return std::numeric_limits<double>::infinity();
  return square * std::max(0.0, freedom - own_freedom) / (freedom - own_square);
}

double kept_variance(int dimension, double gate) {
  const double outside = std::exp(-gate / 2);
  if (dimension == 2) return 1 - 0.5 * gate * outside / (1 - outside);
  const double t = std::sqrt(gate_for(1, gate));
  const double density = std::exp(-t * t / 2) / std::sqrt(2 * std::numbers::pi);
  return 1 - 2 * t * density / (1 - outside);
}

double cost_of_gate(int dimension, double gate) {
  // Beyond the gate lies P(out) of the data and 1 - (1 - P(out)) kept of the variance.
  const double outside = std::exp(-gate / 2);
  return 1 - (1 - outside) * kept_variance(dimension, gate) - outside;
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
