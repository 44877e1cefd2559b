#include "solvers/transfer.h"

#include <cmath>

namespace crumple {
namespace {

constexpr int kSurfaceIterations = 20;
constexpr double kSurfaceTolerance_mm = 1e-10;
// A ray within a tenth of a degree of the surface tells nothing.
constexpr double kGrazingCosine = 2e-3;

}  // namespace

Transfer::Transfer(const CalibrationState& state, std::size_t source, std::size_t target, std::size_t placement,
                   std::optional<std::size_t> station)
    : source_lens_(state.rig.sensors[source].lens),
      target_lens_(state.rig.sensors[target].lens),
      board_(state.board_at(placement)),
      source_(sensor_from_board(state, source, placement, station)),
      target_(sensor_from_board(state, target, placement, station)) {}

std::optional<Transfer::SurfacePoint> Transfer::meet(const Eigen::Vector3d& ray) const {
  const Eigen::Quaterniond board_from_source = source_.pose.rotation.conjugate();
  const Eigen::Vector3d origin = -(board_from_source * source_.pose.translation);
  SurfacePoint point;
  point.ray_in_board = board_from_source * ray;
  if (std::abs(point.ray_in_board.z()) < kGrazingCosine * ray.norm()) return std::nullopt;
  point.depth = -origin.z() / point.ray_in_board.z();
  for (int i = 0; i < kSurfaceIterations; ++i) {
    point.in_board = origin + point.depth * point.ray_in_board;
    const double x = point.in_board.x(), y = point.in_board.y();
    point.normal << -board_.d_height_d_xy(x, y).transpose(), 1;
    const double above = point.in_board.z() - board_.height_mm(x, y);
    if (std::abs(above) < kSurfaceTolerance_mm) return point.depth > 0 ? std::optional(point) : std::nullopt;
    point.depth -= above / (point.normal * point.ray_in_board);
  }
  return std::nullopt;
}

std::optional<Eigen::Vector2d> Transfer::operator()(const Eigen::Vector2d& source_pixel) const {
  const auto ray = source_lens_.ray(source_pixel);
  const auto point = ray ? meet(*ray) : std::nullopt;
  if (!point) return std::nullopt;
  return target_lens_.project(target_.pose * point->in_board);
}

std::optional<Eigen::Vector2d> Transfer::operator()(const Eigen::Vector2d& source_pixel,
                                                    TransferDerivative& derivative) const {
  const auto ray = source_lens_.ray_with_gradients(source_pixel);
  const auto point = ray ? meet(ray->direction) : std::nullopt;
  if (!point) return std::nullopt;
  const auto projection = target_lens_.project_with_gradients(target_.pose * point->in_board);
  if (!projection) return std::nullopt;

  // At fixed depth first; sliding along the ray back onto the surface is a projection P = I - v n' / (n'v).
  const Eigen::Matrix3d board_from_source = source_.pose.rotation.conjugate().toRotationMatrix();
  const double slope = point->normal * point->ray_in_board;
  const Eigen::Matrix3d onto_surface = Eigen::Matrix3d::Identity() - point->ray_in_board * point->normal / slope;
  const Eigen::Vector3d lever = point->depth * ray->direction - source_.pose.translation;
  Matrix3x6d d_source_pose;
  d_source_pose << board_from_source * cross_matrix(lever), -board_from_source;

  const Eigen::Matrix<double, 2, 3> d_board_point = projection->d_point * target_.pose.rotation.toRotationMatrix();

  derivative.source_lens = d_board_point * onto_surface * (point->depth * (board_from_source * ray->d_parameters));
  derivative.source_pose = d_board_point * onto_surface * d_source_pose;
  derivative.target_lens = projection->d_parameters;
  derivative.target_pose = projection->d_point * d_transformed_d_pose(target_.pose, point->in_board);
  const double x = point->in_board.x(), y = point->in_board.y();
  const Eigen::Vector2d d_raised = d_board_point * (point->ray_in_board / slope);
  derivative.warp = d_raised * board_.d_height_d_warp(x, y).transpose();
  derivative.scale = d_raised * board_.d_height_d_scale(x, y);
  return projection->pixel;
}

}  // namespace crumple
