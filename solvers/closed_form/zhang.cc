#include "solvers/closed_form/zhang.h"

#include <cmath>

#include <Eigen/Geometry>
#include <Eigen/LU>

#include "solvers/decompositions.h"

namespace crumple {
namespace {

using Vector6 = Eigen::Matrix<double, 6, 1>;

// Second smallest over largest singular value below this: the views do not determine the intrinsics. Parallel planes
// reach 1e-12 without noise; with corners good to 0.1 px and a lens that bends lines, 5e-4, and 1.6e-3 with a board 66
// px across (docs/calibration.md). Campaigns with tilts 23 degrees apart stay above 7e-3.
constexpr double kParallel = 2e-3;

Vector6 conic_equation(const Eigen::Matrix3d& h, int i, int j) {
  Vector6 v;
  v << h(0, i) * h(0, j), h(0, i) * h(1, j) + h(1, i) * h(0, j), h(1, i) * h(1, j),
      h(2, i) * h(0, j) + h(0, i) * h(2, j), h(2, i) * h(1, j) + h(1, i) * h(2, j), h(2, i) * h(2, j);
  return v;
}

// Pixels moved and scaled so that the homographies' images of the plane's origin lie around zero at unit distance:
// without it the columns of the equations differ by 1e6.
Eigen::Matrix3d pixel_normalisation(const std::vector<Eigen::Matrix3d>& homographies) {
  Eigen::Vector2d centre = Eigen::Vector2d::Zero();
  double spread = 0;
  for (const Eigen::Matrix3d& h : homographies) centre += h.col(2).hnormalized();
  centre /= static_cast<double>(homographies.size());
  for (const Eigen::Matrix3d& h : homographies) spread = std::max(spread, (h.col(2).hnormalized() - centre).norm());
  const double scale = 1 / std::max(spread, 500.0);
  Eigen::Matrix3d m;
  m << scale, 0, -scale * centre.x(), 0, scale, -scale * centre.y(), 0, 0, 1;
  return m;
}

// Two per view, and the skew's.
Eigen::MatrixXd conic_equations(const std::vector<Eigen::Matrix3d>& pixel_from_plane,
                                const Eigen::Matrix3d& normalisation) {
  Eigen::MatrixXd equations(2 * static_cast<int>(pixel_from_plane.size()) + 1, 6);
  int row = 0;
  for (const Eigen::Matrix3d& pixels : pixel_from_plane) {
    Eigen::Matrix3d h = normalisation * pixels;
    h /= std::sqrt(h.col(0).norm() * h.col(1).norm());
    equations.row(row++) = conic_equation(h, 0, 1);
    equations.row(row++) = conic_equation(h, 0, 0) - conic_equation(h, 1, 1);
  }
  equations.row(row) << 0, static_cast<double>(pixel_from_plane.size()), 0, 0, 0, 0;
  return equations;
}

bool leaves_intrinsics_open(const RightSingular& svd) { return svd.values[4] < kParallel * svd.values[0]; }

}  // namespace

Eigen::Matrix3d PinholeIntrinsics::matrix() const {
  Eigen::Matrix3d k;
  k << focal_x_px, 0, principal_point_px.x(), 0, focal_y_px, principal_point_px.y(), 0, 0, 1;
  return k;
}

Expected<PinholeIntrinsics> zhang_intrinsics(const std::vector<Eigen::Matrix3d>& pixel_from_plane) {
  if (pixel_from_plane.size() < 2) return fail("the intrinsics need the board in at least two different tilts");
  const Eigen::Matrix3d normalisation = pixel_normalisation(pixel_from_plane);
  const RightSingular svd = right_singular(conic_equations(pixel_from_plane, normalisation));
  if (leaves_intrinsics_open(svd)) {
    return fail(
        "all board placements are parallel, or nearly so, and the focal length cannot be told: tilt the board between "
        "views");
  }
  Vector6 b = svd.vectors.col(5);
  if (b[0] < 0) b = -b;
  // Appendix B with zero skew.
  const double cx = -b[3] / b[0];
  const double cy = -b[4] / b[2];
  const double scale = b[5] + b[3] * cx + b[4] * cy;
  if (!(b[2] > 0) || !(scale > 0)) {
    return fail("the views contradict one pinhole: tilt the board more, about both axes, and check its corner grid");
  }
  const double pixels_per_unit = 1 / normalisation(0, 0);
  const Eigen::Vector2d centre = normalisation.inverse().col(2).head<2>();
  return PinholeIntrinsics{pixels_per_unit * std::sqrt(scale / b[0]), pixels_per_unit * std::sqrt(scale / b[2]),
                           centre + pixels_per_unit * Eigen::Vector2d(cx, cy)};
}

Expected<PinholeIntrinsics> intrinsics_about(const Eigen::Vector2d& principal_point_px,
                                             const std::vector<Eigen::Matrix3d>& pixel_from_plane) {
  Eigen::Matrix3d centred = Eigen::Matrix3d::Identity();
  centred.col(2).head<2>() = -principal_point_px;
  // With a and c the parts across and along the axis of an equation's two products, a / f^2 + c = 0.
  double numerator = 0, denominator = 0;
  for (const Eigen::Matrix3d& pixels : pixel_from_plane) {
    Eigen::Matrix3d h = centred * pixels;
    h /= std::sqrt(h.col(0).norm() * h.col(1).norm());
    const auto add = [&](double across, double along) {
      numerator -= across * along;
      denominator += along * along;
    };
    add(h.col(0).head<2>().dot(h.col(1).head<2>()), h(2, 0) * h(2, 1));
    add(h.col(0).head<2>().squaredNorm() - h.col(1).head<2>().squaredNorm(), h(2, 0) * h(2, 0) - h(2, 1) * h(2, 1));
  }
  if (!(numerator > 0 && denominator > 0)) {
    return fail("the views contradict one focal length: tilt the board more, about both axes, and check its grid");
  }
  const double focal_px = std::sqrt(numerator / denominator);
  return PinholeIntrinsics{focal_px, focal_px, principal_point_px};
}

bool planes_are_parallel(const std::vector<Eigen::Matrix3d>& pixel_from_plane) {
  return leaves_intrinsics_open(
      right_singular(conic_equations(pixel_from_plane, pixel_normalisation(pixel_from_plane))));
}

Pose plane_pose(const Eigen::Matrix3d& pixel_from_plane, const Eigen::Matrix3d& intrinsics) {
  Eigen::Matrix3d m = intrinsics.inverse() * pixel_from_plane;
  m /= 0.5 * (m.col(0).norm() + m.col(1).norm());
  if (m(2, 2) < 0) m = -m;
  Eigen::Matrix3d rotation;
  rotation << m.col(0), m.col(1), m.col(0).cross(m.col(1));
  return {Eigen::Quaterniond(nearest_rotation(rotation)), m.col(2)};
}

}  // namespace crumple
