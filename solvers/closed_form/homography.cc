#include "solvers/closed_form/homography.h"

#include <cassert>
#include <cmath>

#include <Eigen/Geometry>
#include <Eigen/LU>

#include "solvers/decompositions.h"

namespace crumple {
namespace {

// Second smallest over largest singular value below this: the pairs leave a family of homographies.
constexpr double kDegenerate = 1e-7;

}  // namespace

Eigen::Matrix3d normalising_similarity(const Points2d& points) {
  Eigen::Vector2d centroid = Eigen::Vector2d::Zero();
  for (const Eigen::Vector2d& p : points) centroid += p;
  centroid /= static_cast<double>(points.size());
  double distance = 0;
  for (const Eigen::Vector2d& p : points) distance += (p - centroid).norm();
  distance /= static_cast<double>(points.size());
  const double scale = distance > 0 ? std::sqrt(2.0) / distance : 1.0;
  Eigen::Matrix3d similarity;
  similarity << scale, 0, -scale * centroid.x(), 0, scale, -scale * centroid.y(), 0, 0, 1;
  return similarity;
}

Eigen::Vector2d apply_homography(const Eigen::Matrix3d& b_from_a, const Eigen::Vector2d& a) {
  return (b_from_a * a.homogeneous()).hnormalized();
}

Expected<Eigen::Matrix3d> homography(const Points2d& a, const Points2d& b) {
  assert(a.size() == b.size());
  if (a.size() < 4) return fail("a homography needs at least four point pairs");
  const Eigen::Matrix3d normalised_a = normalising_similarity(a);
  const Eigen::Matrix3d normalised_b = normalising_similarity(b);
  Eigen::MatrixXd equations = Eigen::MatrixXd::Zero(2 * static_cast<int>(a.size()), 9);
  for (std::size_t i = 0; i < a.size(); ++i) {
    const Eigen::RowVector3d p = (normalised_a * a[i].homogeneous()).transpose();
    const Eigen::Vector3d q = normalised_b * b[i].homogeneous();
    const int row = 2 * static_cast<int>(i);
    equations.block<1, 3>(row, 0) = p;
    equations.block<1, 3>(row, 6) = -q.x() * p;
    equations.block<1, 3>(row + 1, 3) = p;
    equations.block<1, 3>(row + 1, 6) = -q.y() * p;
  }
  const RightSingular svd = right_singular(equations);
  if (svd.values[7] < kDegenerate * svd.values[0]) {
    return fail("the point pairs do not determine a homography: too many lie on one line");
  }
  const Eigen::Matrix3d h = svd.vectors.col(8).reshaped<Eigen::RowMajor>(3, 3);
  const Eigen::Matrix3d b_from_a = (normalised_b.inverse() * h * normalised_a).normalized();
  return b_from_a(2, 2) < 0 ? Eigen::Matrix3d(-b_from_a) : b_from_a;
}

}  // namespace crumple
