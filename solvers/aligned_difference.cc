#include "solvers/aligned_difference.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numbers>

#include "solvers/decompositions.h"
#include "solvers/distribution_tails.h"

namespace crumple {
namespace {

constexpr double kNegligible = 1e-6;  // of the largest part of a root

// Of one point, with the floor.
Eigen::MatrixXd point_covariance(const Eigen::MatrixXd& root, int dimension, int point, double floor) {
  const auto rows = root.middleRows(dimension * point, dimension);
  return rows.lazyProduct(rows.transpose()) +
         floor * floor / dimension * Eigen::MatrixXd::Identity(dimension, dimension);
}

// G of the header.
Eigen::MatrixXd motion_from_values(const Differences& d) {
  Eigen::MatrixXd weighted(d.by_frame.rows(), d.by_frame.cols());  // W A
  for (int p = 0; p < d.values.size() / d.dimension; ++p) {
    weighted.middleRows(d.dimension * p, d.dimension) = solve_symmetric(
        point_covariance(d.root, d.dimension, p, d.floor), d.by_frame.middleRows(d.dimension * p, d.dimension));
  }
  // Rotation and translation have different units; a motion that hardly changes
  // anything stays small.
  const Eigen::MatrixXd information = d.by_frame.transpose() * weighted;
  const Eigen::VectorXd scale = information.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
  const SymmetricEigen eigen = symmetric_eigen(scale.asDiagonal() * information * scale.asDiagonal());
  const Eigen::VectorXd inverse = eigen.values.unaryExpr([](double v) { return v > 1e-10 ? 1 / v : 0.0; });
  return scale.asDiagonal() * (eigen.vectors * (inverse.asDiagonal() * (eigen.vectors.transpose() *
                                                                        (scale.asDiagonal() * weighted.transpose()))));
}

// U S, the principal parts of a root; by the squares of the smaller side, whose
// lost digits lie below any floor.
Eigen::MatrixXd principal_parts(const Eigen::MatrixXd& root) {
  if (root.cols() <= root.rows()) return root * symmetric_eigen(root.transpose() * root).vectors;
  const SymmetricEigen eigen = symmetric_eigen(root * root.transpose());
  return eigen.vectors * eigen.values.cwiseMax(0).cwiseSqrt().asDiagonal();
}

void test(AlignedDifference& result) {
  const double least_square = result.floor * result.floor * result.points();  // e^2
  const Eigen::MatrixXd parts = principal_parts(result.root);
  const double largest = parts.cols() > 0 ? parts.colwise().norm().maxCoeff() : 0;
  double explained = 0;
  double degrees = 0;
  for (Eigen::Index k = 0; k < parts.cols(); ++k) {
    const double s = parts.col(k).norm();
    if (!(s > kNegligible * largest)) continue;
    const double component = parts.col(k).dot(result.values) / s;
    explained += component * component;
    result.statistic += component * component / (s * s + least_square);
    degrees += s * s / (s * s + least_square);
  }
  result.degrees = static_cast<int>(std::lround(degrees));
  result.probability = chi_square_tail(result.statistic, result.degrees);
  result.unexplained = std::sqrt(std::max(0.0, result.values.squaredNorm() - explained) / result.points());
}

}  // namespace

Eigen::MatrixXd covariance_root(const Eigen::MatrixXd& covariance) {
  const Eigen::VectorXd scale = covariance.diagonal().cwiseSqrt();
  const Eigen::VectorXd inverse = scale.unaryExpr([](double s) { return s > 0 ? 1 / s : 0.0; });
  const SymmetricEigen eigen = symmetric_eigen(inverse.asDiagonal() * covariance * inverse.asDiagonal());
  return scale.asDiagonal() * eigen.vectors * eigen.values.cwiseMax(0).cwiseSqrt().asDiagonal();
}

double AlignedDifference::rms() const { return std::sqrt(values.squaredNorm() / points()); }

double AlignedDifference::expected_rms() const { return std::sqrt(root.squaredNorm() / points()); }

double AlignedDifference::length(int point) const { return values.segment(dimension * point, dimension).norm(); }

double AlignedDifference::sigmas(int point) const {
  const Eigen::VectorXd d = values.segment(dimension * point, dimension);
  const Eigen::MatrixXd with_floor = covariance[static_cast<std::size_t>(point)] +
                                     floor * floor / dimension * Eigen::MatrixXd::Identity(dimension, dimension);
  return std::sqrt(std::max(0.0, d.dot(solve_symmetric(with_floor, d).col(0))));
}

double AlignedDifference::sigma(int point) const {
  return std::sqrt(std::max(0.0, symmetric_eigen(covariance[static_cast<std::size_t>(point)]).values.tail<1>()[0]));
}

AlignedDifference aligned_difference(const Differences& differences) {
  assert(differences.values.size() > differences.by_frame.cols() && differences.floor > 0);
  AlignedDifference result;
  result.floor = differences.floor;
  result.dimension = differences.dimension;
  result.values = differences.values;
  result.root = differences.root;
  if (differences.by_frame.cols() > 0) {
    const Eigen::MatrixXd from_values = motion_from_values(differences);
    result.motion = from_values * differences.values;
    result.root_of_motion = from_values * differences.root;
    result.values -= differences.by_frame * result.motion;
    result.root -= differences.by_frame * result.root_of_motion;
  }
  const int points = static_cast<int>(differences.values.size()) / differences.dimension;
  for (int p = 0; p < points; ++p) {
    result.covariance.push_back(point_covariance(result.root, differences.dimension, p, 0));
  }
  test(result);
  return result;
}

double outside_probability(double k) { return std::erfc(k / std::numbers::sqrt2); }

}  // namespace crumple
