#include "recon/triangulate.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <vector>

namespace crumple {
namespace {

constexpr int kPlaneIterations = 20;
constexpr double kTolerance_px = 1e-10;
// A coordinate that changes by less over the whole depth range of a scene is no depth measurement.
constexpr double kLeastRate_px = 1e-3;  // per doubling of depth

}  // namespace

StripeTriangulator::StripeTriangulator(const Lens& projector, const Pose& proj_from_cam, const Eigen::Vector2d& normal)
    : projector_(projector),
      rotation_(proj_from_cam.rotation.toRotationMatrix()),
      translation_(proj_from_cam.translation),
      normal_(normal) {}

std::optional<double> StripeTriangulator::coordinate_px(const Eigen::Vector3d& ray, double depth_mm) const {
  const auto pixel = projector_.project(rotation_ * (depth_mm * ray) + translation_);
  if (!pixel) return std::nullopt;
  return normal_.dot(*pixel);
}

// Without distortion n . (f x / z + c) = s is the plane a . X = 0 through the projector's centre.
double StripeTriangulator::plane_depth(const Eigen::Vector3d& ray, double coordinate_px) const {
  const std::vector<double>& lens = projector_.parameters();
  const Eigen::Vector3d a(normal_.x() * lens[0], normal_.y() * lens[1],
                          normal_.x() * lens[2] + normal_.y() * lens[3] - coordinate_px);
  return -a.dot(translation_) / a.dot(rotation_ * ray);
}

std::optional<StripeDepth> StripeTriangulator::operator()(const Eigen::Vector3d& ray, double coordinate_px) const {
  const Eigen::Vector3d direction = rotation_ * ray;
  double depth = plane_depth(ray, coordinate_px);
  if (!std::isfinite(depth) || depth <= 0) return std::nullopt;
  for (int i = 0; i < kPlaneIterations; ++i) {
    const Eigen::Vector3d point = depth * direction + translation_;
    const auto projection = depth > 0 ? projector_.project_with_gradients(point) : std::nullopt;
    if (!projection) return std::nullopt;
    const double rate = normal_.dot(projection->d_point * direction);
    const double error = normal_.dot(projection->pixel) - coordinate_px;
    if (!std::isfinite(error) || !(std::abs(rate) * depth > kLeastRate_px)) return std::nullopt;
    const double step = error / rate;
    // Once the step is lost in the depth's own rounding there is nothing left to gain.
    if (std::abs(error) < kTolerance_px || std::abs(step) < 1e-14 * depth) return StripeDepth{depth - step, 1 / rate};
    depth -= step;
  }
  return std::nullopt;
}

CombinedDepth average_depth(std::span<const DepthReading> readings) {
  assert(!readings.empty());
  const auto n = static_cast<double>(readings.size());
  CombinedDepth result{.quality = 1, .used = static_cast<int>(readings.size())};
  double variance = 0;
  for (const DepthReading& r : readings) {
    result.depth_mm += r.depth_mm / n;
    variance += std::pow(r.d_depth_d_coordinate * r.sigma_px / n, 2);
  }
  result.sigma_mm = std::sqrt(variance);
  double chi_square = 0;
  for (const DepthReading& r : readings) {
    chi_square += std::pow((r.depth_mm - result.depth_mm) / (r.d_depth_d_coordinate * r.sigma_px), 2);
  }
  if (n > 1) result.quality = std::min(1.0, (n - 1) / std::max(chi_square, 1e-300));
  if (n == 1) result.quality = 0.5;
  return result;
}

namespace {

struct Weighted {
  CombinedDepth depth;
  double chi_square = 0;
  std::size_t worst = 0;
};

Weighted weigh(const std::vector<DepthReading>& readings, double common_sigma_px) {
  const auto weight = [&](const DepthReading& r) {
    const double variance_px2 = r.sigma_px * r.sigma_px + common_sigma_px * common_sigma_px;
    return 1 / (r.d_depth_d_coordinate * r.d_depth_d_coordinate * variance_px2);
  };
  Weighted w;
  double total = 0;
  for (const DepthReading& r : readings) {
    total += weight(r);
    w.depth.depth_mm += weight(r) * r.depth_mm;
  }
  w.depth.depth_mm /= total;
  double variance = 0;
  double worst = -1;
  for (std::size_t i = 0; i < readings.size(); ++i) {
    const DepthReading& r = readings[i];
    variance += std::pow(weight(r) / total * r.d_depth_d_coordinate * r.sigma_px, 2);
    const double square = weight(r) * std::pow(r.depth_mm - w.depth.depth_mm, 2);
    w.chi_square += square;
    // Standardised: a reading that carries the average has a small residual and a small redundancy.
    const double redundancy = std::max(1 - weight(r) / total, 1e-12);
    if (square / redundancy > worst) {
      worst = square / redundancy;
      w.worst = i;
    }
  }
  w.depth.sigma_mm = std::sqrt(variance);
  w.depth.used = static_cast<int>(readings.size());
  return w;
}

}  // namespace

std::optional<CombinedDepth> weighted_depth(std::span<const DepthReading> readings, double common_sigma_px,
                                            double gate) {
  assert(!readings.empty());
  std::vector<DepthReading> left(readings.begin(), readings.end());
  Weighted w = weigh(left, common_sigma_px);
  while (left.size() > 2 && w.chi_square > gate * static_cast<double>(left.size() - 1)) {
    left.erase(left.begin() + static_cast<std::ptrdiff_t>(w.worst));
    w = weigh(left, common_sigma_px);
  }
  const auto freedom = static_cast<double>(left.size() - 1);
  if (w.chi_square > gate * freedom && freedom > 0) return std::nullopt;
  w.depth.quality = freedom > 0 ? std::min(1.0, freedom / std::max(w.chi_square, 1e-300)) : 0.5;
  return w.depth;
}

}  // namespace crumple
