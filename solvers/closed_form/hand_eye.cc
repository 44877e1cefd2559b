#include "solvers/closed_form/hand_eye.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include <fmt/format.h>

#include "solvers/decompositions.h"

namespace crumple {
namespace {

constexpr double kSmallestTurn_rad = 1e-3;
constexpr double kAboveNoise = 2;
constexpr double kHalfTurnMargin_rad = 0.09;
constexpr double kDegree = std::numbers::pi / 180;

bool axis_is_told(const Eigen::Vector3d& turn) {
  const double angle = turn.norm();
  return angle > kSmallestTurn_rad && angle < std::numbers::pi - kHalfTurnMargin_rad;
}

// n_A and n_B of the motions that tell them.
struct AxisPair {
  Eigen::Vector3d hand;
  Eigen::Vector3d eye;
};

std::vector<AxisPair> axes_of(const std::vector<HandEyeMotion>& motions) {
  std::vector<AxisPair> axes;
  for (const HandEyeMotion& motion : motions) {
    const Eigen::Vector3d hand = rotation_vector(motion.hand.rotation), eye = rotation_vector(motion.eye.rotation);
    if (axis_is_told(hand) && axis_is_told(eye)) axes.push_back({hand.normalized(), eye.normalized()});
  }
  return axes;
}

Eigen::Quaterniond aligning_rotation(const std::vector<AxisPair>& axes) {
  Eigen::Matrix4d sum = Eigen::Matrix4d::Zero();
  for (const AxisPair& axis : axes) {
    Eigen::Matrix4d d;
    d << 0, -(axis.hand - axis.eye).transpose(), axis.hand - axis.eye, cross_matrix(axis.hand + axis.eye);
    sum += d.transpose() * d;
  }
  const Eigen::VectorXd q = symmetric_eigen(sum).vectors.col(0);
  return Eigen::Quaterniond(q[0], q[1], q[2], q[3]).normalized();
}

Eigen::Vector3d translation_for(const Eigen::Quaterniond& rotation, const std::vector<HandEyeMotion>& motions) {
  const auto rows = 3 * static_cast<Eigen::Index>(motions.size());
  Eigen::MatrixXd matrix(rows, 3);
  Eigen::VectorXd right(rows);
  for (Eigen::Index i = 0; i < rows / 3; ++i) {
    const HandEyeMotion& motion = motions[static_cast<std::size_t>(i)];
    matrix.middleRows<3>(3 * i) = motion.hand.rotation.toRotationMatrix() - Eigen::Matrix3d::Identity();
    right.segment<3>(3 * i) = rotation * motion.eye.translation - motion.hand.translation;
  }
  return least_squares(matrix, right);
}

}  // namespace

MotionConditioning conditioning_of(const std::vector<HandEyeMotion>& motions) {
  MotionConditioning conditioning;
  if (motions.empty()) return conditioning;
  Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
  double squares = 0;
  for (const HandEyeMotion& motion : motions) {
    const Eigen::Vector3d turn = 2 * motion.hand.rotation.vec();
    spread += turn * turn.transpose();
    const double difference =
        rotation_vector(motion.hand.rotation).norm() - rotation_vector(motion.eye.rotation).norm();
    squares += difference * difference;
  }
  const auto count = static_cast<double>(motions.size());
  const SymmetricEigen eigen = symmetric_eigen(spread / count);
  conditioning.turn_rad = std::sqrt(spread.trace() / count);
  conditioning.cross_turn_rad = std::sqrt(std::max(0.0, eigen.values[0] + eigen.values[1]));
  conditioning.disagreement_rad = std::sqrt(squares / count);
  conditioning.main_axis = eigen.vectors.col(2);
  return conditioning;
}

Expected<void> check_conditioning(const MotionConditioning& c) {
  const double least = std::max(kSmallestTurn_rad, kAboveNoise * c.disagreement_rad);
  if (!(c.turn_rad >= least)) {
    return fail(
        fmt::format("the rotations are too small: {:.3g} deg RMS, where hand and eye disagree by {:.3g} deg; turn "
                    "the hand further between poses",
                    c.turn_rad / kDegree, c.disagreement_rad / kDegree));
  }
  if (!(c.cross_turn_rad >= least)) {
    return fail(fmt::format(
        "the rotations' axes are parallel: about ({:.2f}, {:.2f}, {:.2f}) of the hand {:.3g} deg RMS, about all other "
        "axes {:.3g} deg, where hand and eye disagree by {:.3g} deg; turn the hand about two different axes",
        c.main_axis.x(), c.main_axis.y(), c.main_axis.z(), c.turn_rad / kDegree, c.cross_turn_rad / kDegree,
        c.disagreement_rad / kDegree));
  }
  return {};
}

Expected<HandEyeStart> hand_eye_start(const std::vector<HandEyeMotion>& motions) {
  if (motions.size() < 2) return fail("a hand-eye pose needs at least two motions, that is three poses");
  HandEyeStart start;
  start.conditioning = conditioning_of(motions);
  if (const auto sound = check_conditioning(start.conditioning); !sound) return tl::unexpected(sound.error());
  const std::vector<AxisPair> axes = axes_of(motions);
  if (axes.size() < 2) return fail("fewer than two motions turn by more than nothing and less than half a turn");
  start.hand_from_eye.rotation = aligning_rotation(axes);
  double squares = 0;
  for (const AxisPair& axis : axes) squares += (axis.hand - start.hand_from_eye.rotation * axis.eye).squaredNorm();
  start.axis_rms_rad = std::sqrt(squares / static_cast<double>(axes.size()));
  start.hand_from_eye.translation = translation_for(start.hand_from_eye.rotation, motions);
  if (!start.hand_from_eye.translation.allFinite()) return fail("the poses hold numbers that are not finite");
  return start;
}

}  // namespace crumple
