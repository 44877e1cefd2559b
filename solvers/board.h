// The calibration board: marked points on a plane sheet, slightly bent.
//
// A marked point is where corners meet, or the centre of a disc. Board frame, mm: the points lie in z = 0 where the
// sheet is flat; z = x cross y points into the board, away from a camera that sees x to the right and y down. On grids
// the origin is the first point, x runs along its row and y along its column.
//
// True lengths are the nominal ones times `scale`: one number that images alone can never tell (a larger board further
// away looks the same), so it is 1, or what the board's certificate says (calib/certificate.h).
// Shape (mrcal's): z(x, y) = warp_x (1 - u^2) + warp_y (1 - v^2), u and v running from -1 to 1 between the outermost
// points along x and y; both warp terms in mm.
#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>

namespace crumple {

class Board {
 public:
  Board() = default;
  // Nominal positions. `disc_radius_mm`: of the discs whose centres the points are; 0 where they are corners.
  explicit Board(std::vector<Eigen::Vector2d> points_mm, double disc_radius_mm = 0);
  // Point index = row * columns + column lies at (column, row) times the pitch.
  static Board grid(int columns, int rows, double pitch_mm, double disc_radius_mm = 0);

  std::string name = "board";  // which of several; its parameters are named after it
  Eigen::Vector2d warp_mm = Eigen::Vector2d::Zero();
  double scale = 1;

  int point_count() const { return static_cast<int>(points_mm_.size()); }
  bool has_discs() const { return disc_radius_mm_ > 0; }
  double disc_radius_mm() const { return disc_radius_mm_; }
  const std::vector<Eigen::Vector2d>& nominal_mm() const { return points_mm_; }

  Eigen::Vector3d point(int index) const { return on_surface(points_mm_[static_cast<std::size_t>(index)]); }
  // The point of the sheet that is nominally at `nominal_mm`, and how it moves with the scale.
  Eigen::Vector3d on_surface(const Eigen::Vector2d& nominal_mm) const;
  static Eigen::Vector3d d_on_surface_d_scale(const Eigen::Vector2d& nominal_mm);

  // Of the surface as a height over true x and y.
  double height_mm(double x, double y) const;
  Eigen::Vector2d d_height_d_xy(double x, double y) const;
  Eigen::Vector2d d_height_d_warp(double x, double y) const;
  double d_height_d_scale(double x, double y) const;

 private:
  Eigen::Vector2d normalised(double x, double y) const;  // (u, v)

  std::vector<Eigen::Vector2d> points_mm_;
  double disc_radius_mm_ = 0;
  Eigen::Vector2d centre_mm_ = Eigen::Vector2d::Zero();  // of the points' bounding box, nominal
  Eigen::Vector2d half_size_mm_ = Eigen::Vector2d::Ones();
};

}  // namespace crumple
