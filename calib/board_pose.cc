#include "calib/board_pose.h"

#include <optional>

#include "solvers/decompositions.h"

namespace crumple {
namespace {

constexpr int kPoseIterations = 50;
constexpr double kSettled = 1e-12;  // of the squares' sum
constexpr double kLeastDamping = 1e-9;
constexpr double kMostDamping = 1e6;

struct NormalEquation {
  Matrix6d information = Matrix6d::Zero();
  Vector6d gradient = Vector6d::Zero();
  double squares = 0;
};

std::optional<NormalEquation> linearise(const Rig& rig, const Board& board, const std::vector<CornerView>& views,
                                        const Pose& probe_from_board) {
  NormalEquation equation;
  for (const CornerView& view : views) {
    const Sensor& sensor = rig.sensors[view.sensor];
    const Pose sensor_from_board = sensor.sensor_from_mount * probe_from_board;
    const Matrix6d d_pose = d_composed(sensor.sensor_from_mount, probe_from_board).d_right;
    for (std::size_t i = 0; i < view.corners.size(); ++i) {
      const Eigen::Vector3d corner = board.point(view.corners[i]);
      const auto projection = sensor.lens.project_with_gradients(sensor_from_board * corner);
      if (!projection) return std::nullopt;
      const Eigen::Vector2d residual = projection->pixel - view.pixels[i];
      const Eigen::Matrix<double, 2, 6> jacobian =
          projection->d_point * d_transformed_d_pose(sensor_from_board, corner) * d_pose;
      equation.information += jacobian.transpose() * jacobian;
      equation.gradient += jacobian.transpose() * residual;
      equation.squares += residual.squaredNorm();
    }
  }
  return equation;
}

}  // namespace

// Levenberg and Marquardt: six unknowns want no more.
Expected<Pose> fit_board_pose(const Rig& rig, const Board& board, const std::vector<CornerView>& views,
                              const Pose& start) {
  Pose pose = start;
  auto equation = linearise(rig, board, views, pose);
  if (!equation) return fail("the board's pose cannot be fitted: a corner lies outside a lens's domain");
  double damping = kLeastDamping;
  for (int i = 0; i < kPoseIterations && damping < kMostDamping; ++i) {
    Matrix6d damped = equation->information;
    damped.diagonal() *= 1 + damping;
    const auto step = solve_positive(damped, equation->gradient);
    if (!step) return fail("the corners do not determine the board's pose");
    const Pose moved = retract(pose, -*step);
    const auto there = linearise(rig, board, views, moved);
    if (!there || there->squares > equation->squares) {
      damping = std::max(10 * damping, 1e-4);
      continue;
    }
    const bool settled = equation->squares - there->squares <= kSettled * equation->squares;
    pose = moved;
    equation = there;
    damping = std::max(0.1 * damping, kLeastDamping);
    if (settled) break;
  }
  return pose;
}

}  // namespace crumple
