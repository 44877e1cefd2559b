#include "solvers/pose.h"

#include <cmath>

#include <Eigen/SVD>

namespace crumple {

Pose Pose::operator*(const Pose& a_from_z) const {
  return {(rotation * a_from_z.rotation).normalized(), *this * a_from_z.translation};
}

Pose Pose::inverse() const {
  const Eigen::Quaterniond inverse_rotation = rotation.conjugate();
  return {inverse_rotation, -(inverse_rotation * translation)};
}

Eigen::Quaterniond rotation_from_vector(const Eigen::Vector3d& rotation_vector_rad) {
  const double angle = rotation_vector_rad.norm();
  // sin(a/2)/a by its series where the quotient would lose digits.
  const double scale = angle < 1e-4 ? 0.5 - angle * angle / 48 : std::sin(angle / 2) / angle;
  Eigen::Quaterniond q;
  q.w() = std::cos(angle / 2);
  q.vec() = scale * rotation_vector_rad;
  return q.normalized();
}

Eigen::Vector3d rotation_vector(const Eigen::Quaterniond& rotation) {
  const double sign = rotation.w() < 0 ? -1 : 1;
  const Eigen::Vector3d v = sign * rotation.vec();
  const double sine = v.norm();
  const double cosine = sign * rotation.w();
  const double scale = sine < 1e-8 ? 2 / cosine : 2 * std::atan2(sine, cosine) / sine;
  return scale * v;
}

Pose retract(const Pose& pose, const Vector6d& step) {
  return {(rotation_from_vector(step.head<3>()) * pose.rotation).normalized(), pose.translation + step.tail<3>()};
}

Vector6d local_step(const Pose& from, const Pose& to) {
  Vector6d step;
  step << rotation_vector(to.rotation * from.rotation.conjugate()), to.translation - from.translation;
  return step;
}

Eigen::Matrix3d cross_matrix(const Eigen::Vector3d& v) {
  Eigen::Matrix3d m;
  m << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return m;
}

Eigen::Matrix3d left_jacobian(const Eigen::Vector3d& rotation_vector_rad) {
  const double angle = rotation_vector_rad.norm();
  const Eigen::Matrix3d cross = cross_matrix(rotation_vector_rad);
  const double half_sine = std::sin(0.5 * angle);
  // By their series where the quotients would lose digits.
  const double first = angle < 1e-4 ? 0.5 - angle * angle / 24 : 2 * half_sine * half_sine / (angle * angle);
  const double second = angle < 1e-2 ? (1 - angle * angle / 20) / 6 : (1 - std::sin(angle) / angle) / (angle * angle);
  return Eigen::Matrix3d::Identity() + first * cross + second * cross * cross;
}

Eigen::Matrix3d inverse_left_jacobian(const Eigen::Vector3d& rotation_vector_rad) {
  const double angle = rotation_vector_rad.norm();
  const Eigen::Matrix3d cross = cross_matrix(rotation_vector_rad);
  const double second = angle < 1e-4 ? 1.0 / 12 : 1 / (angle * angle) - 0.5 / (angle * std::tan(0.5 * angle));
  return Eigen::Matrix3d::Identity() - 0.5 * cross + second * cross * cross;
}

Matrix3x6d d_transformed_d_pose(const Pose& pose, const Eigen::Vector3d& x) {
  Matrix3x6d d;
  d << -cross_matrix(pose.rotation * x), Eigen::Matrix3d::Identity();
  return d;
}

CompositionDerivative d_composed(const Pose& left, const Pose& right) {
  const Eigen::Matrix3d r = left.rotation.toRotationMatrix();
  CompositionDerivative d;
  d.d_left.setIdentity();
  d.d_left.bottomLeftCorner<3, 3>() = -cross_matrix(r * right.translation);
  d.d_right.setZero();
  d.d_right.topLeftCorner<3, 3>() = r;
  d.d_right.bottomRightCorner<3, 3>() = r;
  return d;
}

Matrix6d d_inverse(const Pose& pose) {
  const Eigen::Matrix3d inverse = pose.rotation.conjugate().toRotationMatrix();
  Matrix6d d;
  d << -inverse, Eigen::Matrix3d::Zero(), -inverse * cross_matrix(pose.translation), -inverse;
  return d;
}

Eigen::Matrix3d nearest_rotation(const Eigen::Matrix3d& m) {
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(m, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Vector3d signs(1, 1, (svd.matrixU() * svd.matrixV().transpose()).determinant() < 0 ? -1 : 1);
  return svd.matrixU() * signs.asDiagonal() * svd.matrixV().transpose();
}

}  // namespace crumple
