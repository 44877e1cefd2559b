#include "solvers/board.h"

#include <cassert>
#include <utility>

namespace crumple {

Board::Board(std::vector<Eigen::Vector2d> points_mm, double disc_radius_mm)
    : points_mm_(std::move(points_mm)), disc_radius_mm_(disc_radius_mm) {
  assert(!points_mm_.empty());
  Eigen::Vector2d low = points_mm_.front(), high = points_mm_.front();
  for (const Eigen::Vector2d& point : points_mm_) {
    low = low.cwiseMin(point);
    high = high.cwiseMax(point);
  }
  centre_mm_ = 0.5 * (low + high);
  half_size_mm_ = 0.5 * (high - low);
  assert((half_size_mm_.array() > 0).all());
}

Board Board::grid(int columns, int rows, double pitch_mm, double disc_radius_mm) {
  std::vector<Eigen::Vector2d> points;
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns; ++column) points.emplace_back(column * pitch_mm, row * pitch_mm);
  }
  return Board(std::move(points), disc_radius_mm);
}

Eigen::Vector3d Board::on_surface(const Eigen::Vector2d& nominal_mm) const {
  const Eigen::Vector2d at = scale * nominal_mm;
  return {at.x(), at.y(), height_mm(at.x(), at.y())};
}

// The surface is stretched with the points, so the height at a point stays.
Eigen::Vector3d Board::d_on_surface_d_scale(const Eigen::Vector2d& nominal_mm) {
  return {nominal_mm.x(), nominal_mm.y(), 0};
}

Eigen::Vector2d Board::normalised(double x, double y) const {
  return (Eigen::Vector2d(x, y) / scale - centre_mm_).cwiseQuotient(half_size_mm_);
}

double Board::height_mm(double x, double y) const { return d_height_d_warp(x, y).dot(warp_mm); }

Eigen::Vector2d Board::d_height_d_xy(double x, double y) const {
  return -2 / scale * normalised(x, y).cwiseProduct(warp_mm).cwiseQuotient(half_size_mm_);
}

Eigen::Vector2d Board::d_height_d_warp(double x, double y) const {
  return Eigen::Vector2d::Ones() - normalised(x, y).cwiseAbs2();
}

double Board::d_height_d_scale(double x, double y) const {
  return -d_height_d_xy(x, y).dot(Eigen::Vector2d(x, y)) / scale;
}

}  // namespace crumple
