// Which points a lens model can image: where it lies outside, a formula still returns a number, but no light goes
// there.
//
// Frame: the sensor's, z forward; any unit of length.
//   OPENCV4/5/8/12  z > 0 and, with s = (x^2 + y^2) / z^2, inside the first fold of the radial distortion (where the
//                   derivative of r N(s) / D(s) vanishes) and the first zero of its denominator. The tangential and
//                   thin-prism terms, small beside it, are not looked at.
//   CAHVOR          in front of the plane across the lens's axis of symmetry and of the image plane, before and after
//                   distortion, and inside the fold of its radial polynomial (Gennery, Generalized camera calibration,
//                   IJCV 2006).
//   SPLINED         the stereographic coordinates u = 2 tan(theta / 2) (x, y) / |(x, y)| lie where the grid has all the
//                   control points that the spline wants. That may be behind the sensor: up to 180 degrees off axis.
#pragma once

#include <vector>

#include <Eigen/Core>

namespace crumple {

class LensDomain {
 public:
  // Parameters in mrcal's order; fewer than 16 leave the further terms out (4: a pinhole).
  static LensDomain opencv(const std::vector<double>& parameters);
  // Past the fold, to where the formula has its first pole.
  static LensDomain opencv_past_fold(const std::vector<double>& parameters);
  static LensDomain cahvor(const std::vector<double>& parameters);
  // Corners of the valid rectangle in stereographic coordinates.
  static LensDomain stereographic(const Eigen::Vector2d& low, const Eigen::Vector2d& high);

  bool contains(const Eigen::Vector3d& point) const;

  // The largest slope |(x, y)| / z off the axis of symmetry; infinite where only z > 0 bounds it.
  double largest_slope() const;

 private:
  enum class Kind { radial, cahvor, stereographic };
  explicit LensDomain(Kind kind) : kind_(kind) {}

  Kind kind_;
  double largest_square_ = 0;                         // of the slope
  Eigen::Vector3d axis_ = Eigen::Vector3d::UnitZ();   // of symmetry
  Eigen::Vector3d radial_ = Eigen::Vector3d::Zero();  // CAHVOR's r0 r1 r2
  Eigen::Vector2d low_ = Eigen::Vector2d::Zero();
  Eigen::Vector2d high_ = Eigen::Vector2d::Zero();
};

}  // namespace crumple
