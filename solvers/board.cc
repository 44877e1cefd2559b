#include "solvers/board.h"

#include <cassert>

namespace crumple {
namespace {

// From board x (or y) to -1..1 between the outermost corners, and the scale of that map.
struct Normalised {
  double value;
  double per_mm;
};

Normalised normalise(double x_mm, int corners, double pitch_mm) {
  const double half_mm = 0.5 * (corners - 1) * pitch_mm;
  return {x_mm / half_mm - 1, 1 / half_mm};
}

}  // namespace

Eigen::Vector3d Board::corner(int index) const {
  assert(index >= 0 && index < corner_count());
  const double x = index % columns * pitch_mm;
  const double y = index / columns * pitch_mm;
  return {x, y, height_mm(x, y)};
}

double Board::height_mm(double x, double y) const { return d_height_d_warp(x, y).dot(warp_mm); }

Eigen::Vector2d Board::d_height_d_xy(double x, double y) const {
  const Normalised u = normalise(x, columns, pitch_mm);
  const Normalised v = normalise(y, rows, pitch_mm);
  return {-2 * u.value * u.per_mm * warp_mm.x(), -2 * v.value * v.per_mm * warp_mm.y()};
}

Eigen::Vector2d Board::d_height_d_warp(double x, double y) const {
  const Normalised u = normalise(x, columns, pitch_mm);
  const Normalised v = normalise(y, rows, pitch_mm);
  return {1 - u.value * u.value, 1 - v.value * v.value};
}

}  // namespace crumple
