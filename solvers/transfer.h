// The transfer through the board: a pixel of one sensor, met with the board's surface, seen by another sensor.
//
//   target pixel = lens_target(target_from_board * X),   X = the board point on the source pixel's ray
//
// With a camera as the source and a projector as the target this predicts the decoded stripe coordinate; the other way
// round it predicts where the camera sees a projected feature. The surface is the warped board (solvers/board.h); X is
// found by Newton's method and its derivatives by the implicit function theorem.
#pragma once

#include <cstddef>
#include <optional>

#include <Eigen/Core>

#include "solvers/sensor_chain.h"

namespace crumple {

using Matrix2x6d = Eigen::Matrix<double, 2, 6>;

struct TransferDerivative {
  Matrix2Xd source_lens;
  Matrix2x6d source_pose;  // source_from_board
  Matrix2Xd target_lens;
  Matrix2x6d target_pose;  // target_from_board
  Eigen::Matrix2d warp;
  Eigen::Vector2d scale;
};

class Transfer {
 public:
  // `station` as the views have it (solvers/observations.h).
  Transfer(const CalibrationState& state, std::size_t source, std::size_t target, std::size_t placement,
           std::optional<std::size_t> station = {});

  // No value where the source pixel has no ray, the ray misses the board's surface, or the point lies behind a sensor.
  std::optional<Eigen::Vector2d> operator()(const Eigen::Vector2d& source_pixel) const;
  std::optional<Eigen::Vector2d> operator()(const Eigen::Vector2d& source_pixel, TransferDerivative& derivative) const;

  // The board in both sensors, and how its poses follow from mounts, station and placement.
  const SensorChain& source() const { return source_; }
  const SensorChain& target() const { return target_; }

 private:
  struct SurfacePoint {
    double depth;              // multiple of the ray (x, y, 1)
    Eigen::Vector3d in_board;  // mm
    Eigen::Vector3d ray_in_board;
    Eigen::RowVector3d normal;  // gradient of z - height(x, y)
  };
  std::optional<SurfacePoint> meet(const Eigen::Vector3d& ray) const;

  const Lens& source_lens_;
  const Lens& target_lens_;
  const Board& board_;
  SensorChain source_;
  SensorChain target_;
};

}  // namespace crumple
