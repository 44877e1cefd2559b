#include "datasets/render/surfaces.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include <Eigen/LU>

namespace crumple {
namespace {

constexpr double settled_mm = 1e-9;
constexpr double nothing_left = 40;  // exp(-40) of any depth is below rounding

}  // namespace

bool Extent::contains(const Eigen::Vector2d& xy) const {
  return (xy.array() >= low.array()).all() && (xy.array() <= high.array()).all();
}

Eigen::Vector2d Extent::clamped(const Eigen::Vector2d& xy) const { return xy.cwiseMax(low).cwiseMin(high); }

SurfacePoint Surface::at(double x, double y) const {
  const Eigen::Vector2d gradient = slope(x, y);
  return {Eigen::Vector3d(x, y, height_mm(x, y)), Eigen::Vector3d(gradient.x(), gradient.y(), -1).normalized()};
}

std::optional<double> Surface::meet(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction,
                                    double t_start) const {
  const double longest_step = 5 / direction.norm();
  double t = t_start;
  for (int iteration = 0; iteration < 12; ++iteration) {
    const Eigen::Vector3d p = origin + t * direction;
    const double above = p.z() - height_mm(p.x(), p.y());
    const double rate = direction.z() - slope(p.x(), p.y()).dot(direction.head<2>());
    const double step = -above / rate;
    if (!(std::abs(step) <= longest_step)) return std::nullopt;
    t += step;
    if (std::abs(step) * direction.norm() < settled_mm) {
      const Eigen::Vector3d met = origin + t * direction;
      if (!extent().contains(met.head<2>()) || !exists(met.x(), met.y())) return std::nullopt;
      return t;
    }
  }
  return std::nullopt;
}

Eigen::Vector3d Surface::nearest(const Eigen::Vector3d& point) const {
  const Extent bounds = extent();
  const auto on_surface = [&](const Eigen::Vector2d& xy) {
    return Eigen::Vector3d(xy.x(), xy.y(), height_mm(xy.x(), xy.y()));
  };
  // The nearest point lies no further away than the one straight below.
  Eigen::Vector2d best = bounds.clamped(point.head<2>());
  double best_distance = (on_surface(best) - point).norm();
  const double reach = best_distance;
  const Eigen::Vector2d foot = best;
  constexpr int half_grid = 4;
  for (int j = -half_grid; j <= half_grid; ++j) {
    for (int i = -half_grid; i <= half_grid; ++i) {
      const Eigen::Vector2d start = bounds.clamped(foot + reach / half_grid * Eigen::Vector2d(i, j));
      const double distance = (on_surface(start) - point).norm();
      if (distance < best_distance) {
        best = start;
        best_distance = distance;
      }
    }
  }
  for (int iteration = 0; iteration < 100; ++iteration) {
    const Eigen::Vector2d gradient = slope(best.x(), best.y());
    const Eigen::Vector3d offset = point - on_surface(best);
    const Eigen::Vector2d descent = offset.head<2>() + gradient * offset.z();
    const Eigen::Matrix2d normal_matrix = Eigen::Matrix2d::Identity() + gradient * gradient.transpose();
    Eigen::Vector2d step = normal_matrix.inverse() * descent;
    Eigen::Vector2d next = bounds.clamped(best + step);
    // On an edge of the extent, slide along it.
    for (int axis = 0; axis < 2; ++axis) {
      if (next[axis] == best[axis] && step[axis] != 0) {
        step[1 - axis] = descent[1 - axis] / normal_matrix(1 - axis, 1 - axis);
        next = bounds.clamped(best + step);
      }
    }
    double shrink = 1;
    while (shrink > 1e-9 && (on_surface(next) - point).squaredNorm() > offset.squaredNorm()) {
      shrink /= 2;
      next = bounds.clamped(best + shrink * step);
    }
    if (shrink <= 1e-9) break;
    const double moved = (next - best).norm();
    best = next;
    if (moved < settled_mm) break;
  }
  return on_surface(best);
}

double Surface::distance_mm(const Eigen::Vector3d& point) const {
  const Eigen::Vector3d closest = nearest(point);
  const double side = (point - closest).dot(at(closest.x(), closest.y()).normal);
  return std::copysign((point - closest).norm(), side);
}

BoardPlate::BoardPlate(const Target& target, const Eigen::Vector2d& warp_mm, double margin_mm, const Material& white,
                       const Material& black)
    : target_(target), print_(target), board_(board_of(target)), margin_mm_(margin_mm), white_(white), black_(black) {
  board_.warp_mm = warp_mm;
}

Extent BoardPlate::extent() const {
  const Eigen::Vector2d margin = Eigen::Vector2d::Constant(margin_mm_);
  return {print_.extent().low_mm - margin, print_.extent().high_mm + margin};
}

Material BoardPlate::material(double x, double y) const { return print_.dark({x, y}) ? black_ : white_; }

PanelShape car_side(const Eigen::Vector2d& size_mm) {
  const double length = size_mm.x();
  const double height = size_mm.y();
  constexpr double degree = M_PI / 180;
  PanelShape shape;
  shape.size_mm = size_mm;
  shape.curvature_per_mm = {1 / (3.2 * length), 1 / (2.1 * height)};
  shape.creases = {{{0, -0.2 * height}, 1.2 * degree, 11 * degree, 9},
                   {{0, 0.1 * height}, -0.8 * degree, -4 * degree, 14},
                   {{0, 0.36 * height}, 0.5 * degree, 14 * degree, 12}};
  shape.recesses = {{{-0.04 * length, -0.1 * height}, {70, 34}, 15}, {{0.24 * length, -0.1 * height}, {70, 34}, 15}};
  return shape;
}

namespace {

struct PressAt {
  double height_mm;
  Eigen::Vector2d slope;
};

PressAt press_at(const Press& press, const Eigen::Vector2d& p) {
  const Eigen::Vector2d along(std::cos(press.direction_rad), std::sin(press.direction_rad));
  const Eigen::Vector2d across(-along.y(), along.x());
  const double u = along.dot(p - press.centre_mm) / press.half_length_mm;
  const double v = across.dot(p - press.centre_mm);
  const double radius = press.edge_radius_mm;
  const double bent = std::sqrt(v * v + radius * radius);
  const double width = press.half_width_mm;
  const double exponent = u * u * u * u + (radius > 0 ? (bent - radius) / width : v * v / (width * width));
  if (exponent > nothing_left) return {0, Eigen::Vector2d::Zero()};
  const double height = press.depth_mm * std::exp(-exponent);
  const double d_across = radius > 0 ? v / (bent * width) : 2 * v / (width * width);
  return {height, -height * (4 * u * u * u / press.half_length_mm * along + d_across * across)};
}

}  // namespace

Panel::Panel(PanelShape shape, const Material& paint) : shape_(std::move(shape)), paint_(paint) {
  for (const Crease& crease : shape_.creases) {
    const Eigen::Vector2d normal(-std::sin(crease.direction_rad), std::cos(crease.direction_rad));
    folds_.push_back({crease.through_mm, normal, std::tan(crease.angle_rad / 2), crease.radius_mm});
  }
}

Extent Panel::extent() const { return {-shape_.size_mm / 2, shape_.size_mm / 2}; }

double Panel::height_mm(double x, double y) const {
  const Eigen::Vector2d p(x, y);
  double z = 0.5 * shape_.curvature_per_mm.dot(p.cwiseAbs2());
  for (const Fold& fold : folds_) {
    const double d = fold.normal.dot(p - fold.through);
    z += fold.tangent * (std::sqrt(d * d + fold.radius * fold.radius) - fold.radius);
  }
  for (const Recess& recess : shape_.recesses) {
    const double q = (p - recess.centre_mm).cwiseQuotient(recess.half_size_mm).squaredNorm();
    if (q * q < nothing_left) z += recess.depth_mm * std::exp(-q * q);
  }
  for (const Dent& dent : shape_.dents) {
    const double q = (p - dent.centre_mm).squaredNorm() / (2 * dent.radius_mm * dent.radius_mm);
    if (q < nothing_left) z += dent.depth_mm * std::exp(-q);
  }
  for (const Press& press : shape_.presses) z += press_at(press, p).height_mm;
  return z;
}

Eigen::Vector2d Panel::slope(double x, double y) const {
  const Eigen::Vector2d p(x, y);
  Eigen::Vector2d gradient = shape_.curvature_per_mm.cwiseProduct(p);
  for (const Fold& fold : folds_) {
    const double d = fold.normal.dot(p - fold.through);
    gradient += fold.tangent * d / std::sqrt(d * d + fold.radius * fold.radius) * fold.normal;
  }
  for (const Recess& recess : shape_.recesses) {
    const Eigen::Vector2d scaled = (p - recess.centre_mm).cwiseQuotient(recess.half_size_mm);
    const double q = scaled.squaredNorm();
    if (q * q >= nothing_left) continue;
    gradient -= recess.depth_mm * std::exp(-q * q) * 4 * q * scaled.cwiseQuotient(recess.half_size_mm);
  }
  for (const Dent& dent : shape_.dents) {
    const Eigen::Vector2d r = p - dent.centre_mm;
    const double variance = dent.radius_mm * dent.radius_mm;
    const double q = r.squaredNorm() / (2 * variance);
    if (q < nothing_left) gradient -= dent.depth_mm * std::exp(-q) / variance * r;
  }
  for (const Press& press : shape_.presses) gradient += press_at(press, p).slope;
  return gradient;
}

Balls::Balls(double radius_mm, std::vector<Eigen::Vector2d> centres_mm, const Material& finish)
    : radius_mm_(radius_mm), centres_mm_(std::move(centres_mm)), finish_(finish) {}

Extent Balls::extent() const {
  Extent extent{centres_mm_.front(), centres_mm_.front()};
  for (const Eigen::Vector2d& centre : centres_mm_) {
    extent.low = extent.low.cwiseMin(centre);
    extent.high = extent.high.cwiseMax(centre);
  }
  const Eigen::Vector2d rim = Eigen::Vector2d::Constant(kBallRim * radius_mm_);
  return {extent.low - rim, extent.high + rim};
}

Eigen::Vector2d Balls::from_nearest_centre(double x, double y) const {
  Eigen::Vector2d nearest = Eigen::Vector2d(x, y) - centres_mm_.front();
  for (const Eigen::Vector2d& centre : centres_mm_) {
    const Eigen::Vector2d offset = Eigen::Vector2d(x, y) - centre;
    if (offset.squaredNorm() < nearest.squaredNorm()) nearest = offset;
  }
  return nearest;
}

bool Balls::exists(double x, double y) const { return from_nearest_centre(x, y).norm() <= kBallRim * radius_mm_; }

// Beyond the rim it goes on as a cone.
double Balls::height_mm(double x, double y) const {
  const double distance = from_nearest_centre(x, y).norm();
  const double rim = kBallRim * radius_mm_;
  if (distance <= rim) return -std::sqrt(radius_mm_ * radius_mm_ - distance * distance);
  const double height = std::sqrt(radius_mm_ * radius_mm_ - rim * rim);
  return -height + (distance - rim) * rim / height;
}

Eigen::Vector2d Balls::slope(double x, double y) const {
  const Eigen::Vector2d offset = from_nearest_centre(x, y);
  const double distance = offset.norm();
  const double rim = kBallRim * radius_mm_;
  const double at = std::min(distance, rim);
  const double steepness = at / std::sqrt(radius_mm_ * radius_mm_ - at * at);
  return distance > 0 ? Eigen::Vector2d(steepness / distance * offset) : Eigen::Vector2d(Eigen::Vector2d::Zero());
}

}  // namespace crumple
