#include "solvers/opencv_model.h"

#include <algorithm>

namespace crumple {
namespace {

// The distortion terms that a model has, and zeros for those it has not.
struct Terms {
  explicit Terms(const double* parameters, int count) { std::copy(parameters + 4, parameters + count, values); }

  double values[12] = {};
  double k1() const { return values[0]; }
  double k2() const { return values[1]; }
  double p1() const { return values[2]; }
  double p2() const { return values[3]; }
  double k3() const { return values[4]; }
  double k4() const { return values[5]; }
  double k5() const { return values[6]; }
  double k6() const { return values[7]; }
  const double* prism() const { return values + 8; }
};

struct Distorted {
  double x, y;              // before distortion
  double s;                 // x^2 + y^2
  double gain;              // g
  double per_divisor;       // 1 / D
  double image_x, image_y;  // after it
};

Distorted distort(const Terms& t, const Eigen::Vector3d& point) {
  Distorted d;
  d.x = point.x() / point.z();
  d.y = point.y() / point.z();
  d.s = d.x * d.x + d.y * d.y;
  d.per_divisor = 1 / (1 + d.s * (t.k4() + d.s * (t.k5() + d.s * t.k6())));
  d.gain = (1 + d.s * (t.k1() + d.s * (t.k2() + d.s * t.k3()))) * d.per_divisor;
  const double* prism = t.prism();
  d.image_x =
      d.x * d.gain + 2 * t.p1() * d.x * d.y + t.p2() * (d.s + 2 * d.x * d.x) + d.s * (prism[0] + d.s * prism[1]);
  d.image_y =
      d.y * d.gain + t.p1() * (d.s + 2 * d.y * d.y) + 2 * t.p2() * d.x * d.y + d.s * (prism[2] + d.s * prism[3]);
  return d;
}

// d(image) / d(x, y).
Eigen::Matrix2d d_image_d_xy(const Terms& t, const Distorted& d) {
  const double d_numerator = t.k1() + d.s * (2 * t.k2() + d.s * 3 * t.k3());
  const double d_divisor = t.k4() + d.s * (2 * t.k5() + d.s * 3 * t.k6());
  const double d_gain = 2 * (d_numerator - d.gain * d_divisor) * d.per_divisor;  // by s, times 2
  const double* prism = t.prism();
  const double d_prism_x = 2 * (prism[0] + 2 * d.s * prism[1]), d_prism_y = 2 * (prism[2] + 2 * d.s * prism[3]);
  const double mixed = d.x * d.y * d_gain + 2 * t.p1() * d.x + 2 * t.p2() * d.y;
  Eigen::Matrix2d m;
  m(0, 0) = d.gain + d.x * d.x * d_gain + 2 * t.p1() * d.y + 6 * t.p2() * d.x + d_prism_x * d.x;
  m(0, 1) = mixed + d_prism_x * d.y;
  m(1, 0) = mixed + d_prism_y * d.x;
  m(1, 1) = d.gain + d.y * d.y * d_gain + 6 * t.p1() * d.y + 2 * t.p2() * d.x + d_prism_y * d.y;
  return m;
}

void d_parameters(const double* f, int count, const Distorted& d, double* d_u, double* d_v) {
  const double s = d.s, s2 = s * s, s3 = s2 * s;
  const double ux = f[0] * d.x * d.per_divisor, vy = f[1] * d.y * d.per_divisor;
  const double xy = 2 * d.x * d.y;
  const double u[] = {d.image_x,
                      0,
                      1,
                      0,
                      ux * s,
                      ux * s2,
                      f[0] * xy,
                      f[0] * (s + 2 * d.x * d.x),
                      ux * s3,
                      -ux * d.gain * s,
                      -ux * d.gain * s2,
                      -ux * d.gain * s3,
                      f[0] * s,
                      f[0] * s2,
                      0,
                      0};
  const double v[] = {0,
                      d.image_y,
                      0,
                      1,
                      vy * s,
                      vy * s2,
                      f[1] * (s + 2 * d.y * d.y),
                      f[1] * xy,
                      vy * s3,
                      -vy * d.gain * s,
                      -vy * d.gain * s2,
                      -vy * d.gain * s3,
                      0,
                      0,
                      f[1] * s,
                      f[1] * s2};
  std::copy(u, u + count, d_u);
  std::copy(v, v + count, d_v);
}

}  // namespace

Eigen::Vector2d project_opencv(const double* parameters, int count, const Eigen::Vector3d& point) {
  const Distorted d = distort(Terms(parameters, count), point);
  return {parameters[0] * d.image_x + parameters[2], parameters[1] * d.image_y + parameters[3]};
}

OpencvProjection project_opencv_with_gradients(const double* parameters, int count, const Eigen::Vector3d& point,
                                               double* d_u, double* d_v) {
  const Terms terms(parameters, count);
  const Distorted d = distort(terms, point);
  Eigen::Matrix2d m = d_image_d_xy(terms, d);
  m.row(0) *= parameters[0];
  m.row(1) *= parameters[1];
  OpencvProjection projection;
  projection.pixel << parameters[0] * d.image_x + parameters[2], parameters[1] * d.image_y + parameters[3];
  const double per_z = 1 / point.z();
  projection.d_point.leftCols<2>() = m * per_z;
  projection.d_point.col(2) = -(m.col(0) * d.x + m.col(1) * d.y) * per_z;
  if (d_u != nullptr) d_parameters(parameters, count, d, d_u, d_v);
  return projection;
}

}  // namespace crumple
