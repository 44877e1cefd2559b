#include "solvers/small_motion.h"

#include <cassert>

#include "solvers/decompositions.h"

namespace crumple {
namespace {

constexpr double kLeastHeight = 1e-3;  // of the base

}  // namespace

Matrix6d d_motion_d_pose(const Pose& frame_from_body) {
  Matrix6d d = Matrix6d::Identity();
  d.bottomLeftCorner<3, 3>() = cross_matrix(frame_from_body.translation);
  return d;
}

Eigen::MatrixXd d_points_d_motion(const std::vector<Eigen::Vector3d>& points) {
  Eigen::MatrixXd d(3 * static_cast<Eigen::Index>(points.size()), 6);
  for (std::size_t i = 0; i < points.size(); ++i) {
    d.middleRows<3>(3 * static_cast<Eigen::Index>(i)) << -cross_matrix(points[i]), Eigen::Matrix3d::Identity();
  }
  return d;
}

Eigen::MatrixXd d_motion_d_points(const std::vector<Eigen::Vector3d>& points) {
  assert(span_a_frame(points));
  // About the points' middle and in units of their extent, where rotation and translation do not mix.
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& p : points) middle += p / static_cast<double>(points.size());
  std::vector<Eigen::Vector3d> about;
  double square = 0;
  for (const Eigen::Vector3d& p : points) {
    about.push_back(p - middle);
    square += about.back().squaredNorm();
  }
  const double extent = std::sqrt(square / static_cast<double>(points.size()));
  Vector6d scale;
  scale << Eigen::Vector3d::Constant(1 / extent), Eigen::Vector3d::Ones();
  const Eigen::MatrixXd from_motion = d_points_d_motion(about) * scale.asDiagonal();
  Eigen::MatrixXd motion =
      scale.asDiagonal() * solve_symmetric(from_motion.transpose() * from_motion, from_motion.transpose());
  motion.bottomRows<3>() += cross_matrix(middle) * motion.topRows<3>();
  return motion;
}

bool span_a_frame(const std::vector<Eigen::Vector3d>& points) {
  if (points.size() < 3) return false;
  Eigen::MatrixXd about(static_cast<Eigen::Index>(points.size()), 3);
  for (std::size_t i = 0; i < points.size(); ++i) about.row(static_cast<Eigen::Index>(i)) = points[i];
  about.rowwise() -= about.colwise().mean().eval();
  const Eigen::VectorXd extents = right_singular(about).values;
  return extents[1] > kLeastHeight * extents[0];
}

}  // namespace crumple
