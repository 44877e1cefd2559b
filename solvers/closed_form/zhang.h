// Zhang's closed form: intrinsics of a pinhole from homographies of a plane, and the plane's pose from one of them.
//
// Source: Z. Zhang, A Flexible New Technique for Camera Calibration, PAMI 2000. Each homography H = [h1 h2 h3] from the
// plane (mm) to pixels gives two equations on the image of the absolute conic B = K^-T K^-1, unknown b = (B11 B12 B22
// B13 B23 B33) (eq. 8): v12' b = 0 and (v11 - v22)' b = 0; K follows from b (appendix B) and the pose from K^-1 H
// (section 3.1). The skew is held at zero by the further equation b2 = 0 (section 3.1, n = 2), which keeps the start
// sound when tilts are few. The principal point is free, so a projector's offset lens is no special case.
//
// Degenerate where the homographies' planes are all parallel (section 4): that is measured, by the second smallest
// singular value of the equations, and refused, under the noise of real corners too.
#pragma once

#include <vector>

#include <Eigen/Core>

#include "solvers/expected.h"
#include "solvers/pose.h"

namespace crumple {

struct PinholeIntrinsics {
  double focal_x_px = 0;
  double focal_y_px = 0;
  Eigen::Vector2d principal_point_px = Eigen::Vector2d::Zero();

  Eigen::Matrix3d matrix() const;
};

// pixel_from_plane: one homography per view, plane coordinates in mm. Fails with fewer than two views, with parallel
// planes, and where noise has made B indefinite.
Expected<PinholeIntrinsics> zhang_intrinsics(const std::vector<Eigen::Matrix3d>& pixel_from_plane);

// A camera with square pixels whose principal point is known, or nearly: one focal length from the same two equations,
// B = diag(1 / f^2, 1 / f^2, 1) about that point, by least squares. It holds where few corners, or a lens that bends
// lines, leave the six unknowns above to noise. Fails where no focal length explains the views. Of parallel planes it
// says something all the same: ask planes_are_parallel first.
Expected<PinholeIntrinsics> intrinsics_about(const Eigen::Vector2d& principal_point_px,
                                             const std::vector<Eigen::Matrix3d>& pixel_from_plane);

bool planes_are_parallel(const std::vector<Eigen::Matrix3d>& pixel_from_plane);

// The pose sensor_from_plane with the plane in front of the sensor.
Pose plane_pose(const Eigen::Matrix3d& pixel_from_plane, const Eigen::Matrix3d& intrinsics);

}  // namespace crumple
