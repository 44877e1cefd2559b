// What was measured, in memory, as the solvers take it. Indices refer to Rig::sensors and to board placements.
#pragma once

#include <cstddef>
#include <vector>

#include <Eigen/Core>

namespace crumple {

// Marked points of a board seen by a camera: corners, or the centres of gravity of discs.
struct CornerView {
  std::size_t sensor = 0;
  std::size_t placement = 0;
  std::vector<int> corners;  // Board::point indices; partial boards leave some out
  std::vector<Eigen::Vector2d> pixels;
};

// Stripe coordinates met at camera pixels on the board. A stripe orientation has the unit normal n in the projector's
// pixel plane; its coordinate is n . (projector pixel). Noise is in the coordinate; the camera pixel is exact.
struct StripeView {
  std::size_t camera = 0;
  std::size_t projector = 0;
  std::size_t placement = 0;
  Eigen::Vector2d normal = Eigen::Vector2d::UnitX();
  std::vector<Eigen::Vector2d> camera_pixels;
  std::vector<double> coordinates_px;
};

// A projected feature (a chessboard corner the projector casts) seen by a camera on the board. Noise is in the camera.
struct FeatureView {
  std::size_t projector = 0;
  std::size_t camera = 0;
  std::size_t placement = 0;
  std::vector<Eigen::Vector2d> projector_pixels;
  std::vector<Eigen::Vector2d> camera_pixels;
};

struct Observations {
  std::size_t placement_count = 0;
  std::vector<CornerView> corners;
  std::vector<StripeView> stripes;
  std::vector<FeatureView> features;
};

}  // namespace crumple
