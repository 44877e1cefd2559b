#include "tests/solvers/backward_brown.h"

#include "solvers/sensor_chain.h"

namespace crumple {
namespace {

constexpr int kParameters = 9;
using Matrix2x9d = Eigen::Matrix<double, 2, kParameters>;

struct Corrected {
  Eigen::Vector2d mm;
  Matrix2x9d d_parameters;
};

// What the radial and the tangential terms make of a point about the principal point.
Corrected undistorted(const std::vector<double>& p, double x, double y, const Matrix2x9d& d_point) {
  const double k1 = p[4], k2 = p[5], p1 = p[6], p2 = p[7], k3 = p[8];
  const double s = x * x + y * y;
  const double radial = 1 + s * (k1 + s * (k2 + s * k3));
  const double slope = k1 + s * (2 * k2 + s * 3 * k3);  // of `radial` by s
  Corrected result;
  result.mm = {x * radial + p1 * (s + 2 * x * x) - 2 * p2 * x * y, y * radial + 2 * p1 * x * y - p2 * (s + 2 * y * y)};
  Eigen::Matrix2d d_xy;
  d_xy << radial + 2 * x * x * slope + 6 * p1 * x - 2 * p2 * y, 2 * x * y * slope + 2 * p1 * y - 2 * p2 * x,
      2 * x * y * slope + 2 * p1 * y - 2 * p2 * x, radial + 2 * y * y * slope + 2 * p1 * x - 6 * p2 * y;
  result.d_parameters = d_xy * d_point;
  const Eigen::Vector2d point(x, y);
  result.d_parameters.col(4) += s * point;
  result.d_parameters.col(5) += s * s * point;
  result.d_parameters.col(8) += s * s * s * point;
  result.d_parameters.col(6) += Eigen::Vector2d(s + 2 * x * x, 2 * x * y);
  result.d_parameters.col(7) -= Eigen::Vector2d(2 * x * y, s + 2 * y * y);
  return result;
}

Corrected corrected(const std::vector<double>& p, const Eigen::Vector2d& mark_mm, Aspect aspect) {
  const double stretch = p[1], px = p[2], py = p[3];
  double x = mark_mm.x() - px;
  Matrix2x9d d_point = Matrix2x9d::Zero();
  d_point(0, 2) = d_point(1, 3) = -1;
  if (aspect == Aspect::before_distortion) {
    d_point(0, 1) = x;
    d_point(0, 2) = -stretch;
    x *= stretch;
  } else if (aspect == Aspect::before_principal_point) {
    d_point(0, 1) = mark_mm.x();
    x = mark_mm.x() * stretch - px;
  }
  Corrected result = undistorted(p, x, mark_mm.y() - py, d_point);
  if (aspect == Aspect::after_distortion) {
    result.d_parameters.row(0) *= stretch;
    result.d_parameters(0, 1) += result.mm.x();
    result.mm.x() *= stretch;
  }
  return result;
}

class BackwardBrownResiduals final : public View {
 public:
  BackwardBrownResiduals(const LedView& view, double pixel_size_mm, Aspect aspect)
      : View(Kind::leds, view.sensor, std::nullopt, view.station, blocks_of(view)),
        view_(view),
        pixel_size_mm_(pixel_size_mm),
        aspect_(aspect) {}

  int size() const override { return static_cast<int>(view_.pixels.size()); }

  bool evaluate(const CalibrationState& state, bool with_jacobians, ViewEvaluation& evaluation) const override {
    const std::vector<double>& p = state.rig.sensors[view_.sensor].lens.parameters();
    const SensorChain chain = sensor_from_leds(state, view_.sensor, view_.station);
    const int locals = kParameters + 6 + 3 * size();
    evaluation.residuals.resize(2 * size());
    evaluation.jacobian.setZero(with_jacobians ? 2 * size() : 0, locals);
    for (int i = 0; i < size(); ++i) {
      const Eigen::Vector3d& mark = state.rig.leds[view_.leds[static_cast<std::size_t>(i)]].position_mm;
      const Eigen::Vector3d at = chain.pose * mark;
      if (!(at.z() > 0)) return false;
      const Corrected seen = corrected(p, pixel_size_mm_ * view_.pixels[static_cast<std::size_t>(i)], aspect_);
      const Eigen::Vector2d slope = at.head<2>() / at.z();
      evaluation.residuals.segment<2>(2 * i) = (p[0] * slope - seen.mm) / pixel_size_mm_;
      if (!with_jacobians) continue;
      Eigen::Matrix<double, 2, 3> d_point;
      d_point << 1, 0, -slope.x(), 0, 1, -slope.y();
      d_point *= p[0] / at.z();
      auto rows = evaluation.jacobian.middleRows<2>(2 * i);
      rows.leftCols<kParameters>() = -seen.d_parameters;
      rows.col(0) += slope;
      rows.middleCols<6>(kParameters) = d_point * d_transformed_d_pose(chain.pose, mark);
      rows.middleCols<3>(kParameters + 6 + 3 * i) = d_point * chain.pose.rotation.toRotationMatrix();
      rows /= pixel_size_mm_;
    }
    if (!with_jacobians) return true;
    evaluation.local_from_blocks.setZero(locals, locals + 6);
    evaluation.local_from_blocks.leftCols(locals).setIdentity();
    evaluation.local_from_blocks.block<6, 6>(kParameters, kParameters) = chain.d_mount;
    evaluation.local_from_blocks.block<6, 6>(kParameters, locals) = chain.d_station;
    return true;
  }

 private:
  static std::vector<BlockId> blocks_of(const LedView& view) {
    std::vector<BlockId> blocks{{BlockId::Kind::lens, view.sensor}, {BlockId::Kind::mount, view.sensor}};
    for (const std::size_t led : view.leds) blocks.push_back({BlockId::Kind::led, led});
    blocks.push_back({BlockId::Kind::station, *view.station});
    return blocks;
  }

  const LedView& view_;
  double pixel_size_mm_;
  Aspect aspect_;
};

}  // namespace

std::unique_ptr<View> backward_brown_residuals(const LedView& view, double pixel_size_mm, Aspect aspect) {
  return std::make_unique<BackwardBrownResiduals>(view, pixel_size_mm, aspect);
}

}  // namespace crumple
