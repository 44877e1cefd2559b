#include "solvers/closed_form/resection.h"

#include <cassert>
#include <cmath>

#include <Eigen/Geometry>
#include <Eigen/LU>

#include "solvers/decompositions.h"

namespace crumple {
namespace {

constexpr double kPlanar = 1e-5;

Eigen::Matrix4d normalising_similarity_3d(const std::vector<Eigen::Vector3d>& points) {
  Eigen::Vector3d centroid = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& p : points) centroid += p;
  centroid /= static_cast<double>(points.size());
  double distance = 0;
  for (const Eigen::Vector3d& p : points) distance += (p - centroid).norm();
  const double scale = std::sqrt(3.0) * static_cast<double>(points.size()) / distance;
  Eigen::Matrix4d m = Eigen::Matrix4d::Identity();
  m.topLeftCorner<3, 3>() *= scale;
  m.topRightCorner<3, 1>() = -scale * centroid;
  return m;
}

// m = K R with K upper triangular, positive diagonal, and R a rotation, from the QR of the reversed inverse order.
void rq(const Eigen::Matrix3d& m, Eigen::Matrix3d& k, Eigen::Matrix3d& r) {
  const Eigen::Matrix3d reverse = Eigen::Vector3d::Ones().asDiagonal().toDenseMatrix().rowwise().reverse();
  const OrthogonalTriangular qr = orthogonal_triangular((reverse * m).transpose());
  const Eigen::Matrix3d q = qr.q, upper = qr.r;
  k = reverse * upper.transpose() * reverse;
  r = reverse * q.transpose();
  const Eigen::Matrix3d signs = k.diagonal().cwiseSign().asDiagonal();
  k = k * signs;
  r = signs * r;
}

}  // namespace

Expected<Resection> resect(const std::vector<Eigen::Vector3d>& points, const Points2d& pixels) {
  assert(points.size() == pixels.size());
  if (points.size() < 6) return fail("a resection needs at least six points");
  const Eigen::Matrix4d normalised_points = normalising_similarity_3d(points);
  const Eigen::Matrix3d normalised_pixels = normalising_similarity(pixels);
  // Only the 12x12 normal matrix is kept: the points may be many.
  Eigen::Matrix<double, 12, 12> normal = Eigen::Matrix<double, 12, 12>::Zero();
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Eigen::RowVector4d p = (normalised_points * points[i].homogeneous()).transpose();
    const Eigen::Vector3d q = normalised_pixels * pixels[i].homogeneous();
    Eigen::Matrix<double, 2, 12> rows = Eigen::Matrix<double, 2, 12>::Zero();
    rows.block<1, 4>(0, 0) = p;
    rows.block<1, 4>(0, 8) = -q.x() * p;
    rows.block<1, 4>(1, 4) = p;
    rows.block<1, 4>(1, 8) = -q.y() * p;
    normal += rows.transpose() * rows;
  }
  const RightSingular svd = right_singular(normal);
  if (svd.values[10] < kPlanar * kPlanar * svd.values[0]) {
    return fail("the points lie on one plane: a resection needs depth, so tilt or move the board between placements");
  }
  const Eigen::Matrix<double, 3, 4> p = svd.vectors.col(11).reshaped<Eigen::RowMajor>(3, 4);
  Eigen::Matrix<double, 3, 4> projection = normalised_pixels.inverse() * p * normalised_points;
  if (projection.leftCols<3>().determinant() < 0) projection = -projection;
  Eigen::Matrix3d k, r;
  rq(projection.leftCols<3>(), k, r);
  const Eigen::Vector3d t = k.inverse() * projection.col(3);
  k /= k(2, 2);
  Resection result{{k(0, 0), k(1, 1), {k(0, 2), k(1, 2)}}, {Eigen::Quaterniond(r), t}};
  // det > 0 fixes the sign of a proper rotation, but not on which side the points lie.
  if ((result.sensor_from_points * points.front()).z() <= 0) {
    return fail("the points' images contradict a pinhole: check which image axis is which");
  }
  return result;
}

}  // namespace crumple
