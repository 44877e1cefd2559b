// The calibration board: a plane grid of corners, slightly bent.
//
// Board frame, mm: origin at the first inner corner, x along its row, y along its column, z = x cross y (into the
// board, away from a camera that sees x to the right and y down). Shape (mrcal's): z(x, y) = warp_x (1 - u^2) + warp_y
// (1 - v^2), u and v running from -1 to 1 between the outermost corners; both warp terms in mm.
#pragma once

#include <Eigen/Core>

namespace crumple {

struct Board {
  int columns = 0;  // inner corners along x
  int rows = 0;     // inner corners along y
  double pitch_mm = 0;
  Eigen::Vector2d warp_mm = Eigen::Vector2d::Zero();

  int corner_count() const { return columns * rows; }
  // Corner `index` runs along rows first: index = row * columns + column.
  Eigen::Vector3d corner(int index) const;

  double height_mm(double x, double y) const;
  Eigen::Vector2d d_height_d_xy(double x, double y) const;
  Eigen::Vector2d d_height_d_warp(double x, double y) const;
};

}  // namespace crumple
