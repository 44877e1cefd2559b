// Rigid motions between frames.
//
// A Pose named `b_from_a` maps coordinates: x_in_b = b_from_a * x_in_a. Lengths are millimetres.
// Perturbation (the tangent space of every Jacobian and covariance in Crumple): a 6-vector (w, d), rotation first in
// radians, then translation in mm, acting on the left of the rotation and added to the translation:
//   R <- exp([w]x) R,   t <- t + d.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace crumple {

using Vector6d = Eigen::Matrix<double, 6, 1>;
using Matrix6d = Eigen::Matrix<double, 6, 6>;
using Matrix3x6d = Eigen::Matrix<double, 3, 6>;

struct Pose {
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();

  Eigen::Vector3d operator*(const Eigen::Vector3d& x_in_a) const { return rotation * x_in_a + translation; }
  Pose operator*(const Pose& a_from_z) const;
  Pose inverse() const;
};

// exp of a rotation vector (axis times angle in rad); exact to rounding at any angle, zero included.
Eigen::Quaterniond rotation_from_vector(const Eigen::Vector3d& rotation_vector_rad);

// The rotation vector with angle in [0, pi].
Eigen::Vector3d rotation_vector(const Eigen::Quaterniond& rotation);

// The pose moved by a tangent step, and the step that leads from one pose to another (retract's inverse).
Pose retract(const Pose& pose, const Vector6d& step);
Vector6d local_step(const Pose& from, const Pose& to);

Eigen::Matrix3d cross_matrix(const Eigen::Vector3d& v);

// How exp turns with its rotation vector: exp(v + dv) = exp(J(v) dv) exp(v) to first order (Barfoot, State Estimation
// for Robotics, eq. 7.77), and the inverse of J (eq. 7.76). The inverse wants an angle below 2 pi.
Eigen::Matrix3d left_jacobian(const Eigen::Vector3d& rotation_vector_rad);
Eigen::Matrix3d inverse_left_jacobian(const Eigen::Vector3d& rotation_vector_rad);

// The derivative of (pose * x) with respect to the pose's tangent.
Matrix3x6d d_transformed_d_pose(const Pose& pose, const Eigen::Vector3d& x);

// How the tangent of (left * right) follows from those of its factors.
struct CompositionDerivative {
  Matrix6d d_left;
  Matrix6d d_right;
};
CompositionDerivative d_composed(const Pose& left, const Pose& right);
// How the tangent of the inverse follows from the pose's.
Matrix6d d_inverse(const Pose& pose);

// The proper rotation nearest to m in the Frobenius norm (Zhang 2000, appendix C).
Eigen::Matrix3d nearest_rotation(const Eigen::Matrix3d& m);

}  // namespace crumple
