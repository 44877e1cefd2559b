// The projection of OpenCV's lens models, with its derivatives, in the caller's memory.
//
//   x = X / Z, y = Y / Z, s = x^2 + y^2, g = (1 + k1 s + k2 s^2 + k3 s^3) / (1 + k4 s + k5 s^2 + k6 s^3)
//   u = fx (x g + 2 p1 x y + p2 (s + 2 x^2) + s1 s + s2 s^2) + cx
//   v = fy (y g + p1 (s + 2 y^2) + 2 p2 x y + s3 s + s4 s^2) + cy
//
// Parameters in the order fx fy cx cy k1 k2 p1 p2 k3 k4 k5 k6 s1 s2 s3 s4; the first 4 (a pinhole), 8, 9, 12 or 16 of
// them, the others are zero. (Brown 1966, decentering; Claus & Fitzgibbon 2005, the rational form; Weng 1992, the thin
// prism.) libmrcal computes the same in twice the time, and a refinement spends most of its time here.
// Precondition: Z is not zero.
#pragma once

#include <Eigen/Core>

namespace crumple {

struct OpencvProjection {
  Eigen::Vector2d pixel;
  Eigen::Matrix<double, 2, 3> d_point;
};

Eigen::Vector2d project_opencv(const double* parameters, int count, const Eigen::Vector3d& point);

// The derivatives of u and v with respect to the parameters go to d_u and d_v, `count` values each; either both are
// given or none is.
OpencvProjection project_opencv_with_gradients(const double* parameters, int count, const Eigen::Vector3d& point,
                                               double* d_u, double* d_v);

}  // namespace crumple
