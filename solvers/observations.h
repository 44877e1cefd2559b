// What was measured, in memory, as the solvers take it. Indices refer to Rig::sensors, Rig::leds, board placements and
// stations of the probe. `station` tells where the probe was when a view was taken; none where it stands still
// throughout (its frame is the world's then) and for what involves nothing on the probe.
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include <Eigen/Core>

namespace crumple {

// Marked points of a board seen by a camera: corners, or the centres of gravity of discs.
struct CornerView {
  std::size_t sensor = 0;
  std::size_t placement = 0;
  std::vector<int> corners;  // Board::point indices; partial boards leave some out
  std::vector<Eigen::Vector2d> pixels;
  std::optional<std::size_t> station = {};
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
  std::optional<std::size_t> station = {};
};

// A projected feature (a chessboard corner the projector casts) seen by a camera on the board. Noise is in the camera.
struct FeatureView {
  std::size_t projector = 0;
  std::size_t camera = 0;
  std::size_t placement = 0;
  std::vector<Eigen::Vector2d> projector_pixels;
  std::vector<Eigen::Vector2d> camera_pixels;
  std::optional<std::size_t> station = {};
};

// Centres of LED spots seen by a sensor fixed to the world: of the probe's LEDs at a station, or, without one, of
// reference LEDs in the room. Seen by a sensor on the probe at a station: of reference points in the room
// (Mount::world), be they LEDs or targets.
struct LedView {
  std::size_t sensor = 0;
  std::vector<std::size_t> leds;
  std::vector<Eigen::Vector2d> pixels;
  std::optional<std::size_t> station = {};
};

// Points of a surface that stripes met at a station: camera pixels with the coordinate decoded there.
struct StripePoints {
  std::size_t camera = 0;
  std::size_t projector = 0;
  std::size_t station = 0;
  Eigen::Vector2d normal = Eigen::Vector2d::UnitX();  // of the stripes, as above
  std::vector<Eigen::Vector2d> camera_pixels;
  std::vector<double> coordinates_px;
};

// Places that two stations measured: points of the one near tangent planes of the other. Noise is in the coordinates.
struct OverlapView {
  StripePoints here;
  StripePoints there;                          // the planes' points, in the order of `here`
  std::vector<Eigen::Vector3d> there_normals;  // of the planes, unit, in the probe frame of `there`
};

struct Observations {
  std::size_t placement_count = 0;
  std::vector<CornerView> corners;
  std::vector<StripeView> stripes;
  std::vector<FeatureView> features;
  std::vector<LedView> leds = {};
  std::vector<OverlapView> overlaps = {};
};

}  // namespace crumple
