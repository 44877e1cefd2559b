#include "tracking/hand_eye_residuals.h"

#include <cmath>

namespace crumple {

HandEyeResidual residual_of(const PosePair& pair, const HandEyeState& state) {
  const Pose& a = pair.world_from_hand;
  const Pose& b = pair.board_from_eye;
  const Eigen::Matrix3d ra = a.rotation.toRotationMatrix(), ry = state.world_from_board.rotation.toRotationMatrix();
  const Eigen::Vector3d board_in_eye = b.inverse().translation;
  const Eigen::Vector3d turned = state.hand_from_eye.rotation * board_in_eye;
  HandEyeResidual r;
  const Eigen::Quaterniond miss =
      a.rotation * state.hand_from_eye.rotation * b.rotation.conjugate() * state.world_from_board.rotation.conjugate();
  r.rotation_rad = rotation_vector(miss);
  r.lever_mm = a.rotation * (turned + state.hand_from_eye.translation);
  r.position_mm = r.lever_mm + a.translation - state.world_from_board.translation;

  // Turns on the left of `miss`.
  Eigen::Matrix<double, 3, kHandEyeParameters> turn = Eigen::Matrix<double, 3, kHandEyeParameters>::Zero();
  turn.leftCols<3>() = ra;
  turn.middleCols<3>(6) = -miss.toRotationMatrix();
  turn.col(12) = pair.hand_rate.angular_rad_s - miss * (ry * pair.eye_rate.angular_rad_s);
  r.d_rotation = inverse_left_jacobian(r.rotation_rad) * turn;

  const Eigen::Vector3d board_rate =
      b.rotation.conjugate() * (pair.eye_rate.angular_rad_s.cross(b.translation) - pair.eye_rate.linear_mm_s);
  r.d_lever.setZero();
  r.d_lever.leftCols<3>() = -ra * cross_matrix(turned);
  r.d_lever.middleCols<3>(3) = ra;
  r.d_lever.col(12) = pair.hand_rate.angular_rad_s.cross(r.lever_mm) + ra * (state.hand_from_eye.rotation * board_rate);
  r.d_position = r.d_lever;
  r.d_position.middleCols<3>(9) = -Eigen::Matrix3d::Identity();
  r.d_position.col(12) += pair.hand_rate.linear_mm_s;
  return r;
}

WhiteResidual whitened(const HandEyeResidual& r, const HandEyeNoise& noise, const Eigen::Vector3d& lever_mm) {
  const double f = noise.hand_share, distance = lever_mm.norm();
  const Eigen::Vector3d along = distance > 0 ? Eigen::Vector3d(lever_mm / distance) : Eigen::Vector3d::UnitX();
  const double across_sigma =
      std::sqrt(noise.position_mm * noise.position_mm + f * (1 - f) * std::pow(noise.rotation_rad * distance, 2));
  const Eigen::Matrix3d projection = along * along.transpose();
  const Eigen::Matrix3d whitening =
      projection / noise.position_mm + (Eigen::Matrix3d::Identity() - projection) / across_sigma;
  WhiteResidual white;
  white.value << r.rotation_rad / noise.rotation_rad,
      whitening * (r.position_mm - f * r.rotation_rad.cross(r.lever_mm));
  white.jacobian.topRows<3>() = r.d_rotation / noise.rotation_rad;
  white.jacobian.bottomRows<3>() =
      whitening *
      (r.d_position + f * (cross_matrix(r.lever_mm) * r.d_rotation - cross_matrix(r.rotation_rad) * r.d_lever));
  return white;
}

}  // namespace crumple
