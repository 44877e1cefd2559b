#include "datasets/cloud_splats.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include <Eigen/Geometry>

#include "solvers/decompositions.h"

namespace crumple {
namespace {

constexpr double turn_rad = 24 * std::numbers::pi / 180;   // from the side
constexpr double tilt_rad = -26 * std::numbers::pi / 180;  // from above
constexpr double outer_share = 0.002;                      // of the points at either end, not counted for the size

struct GreyRange {
  double low = 0, high = 0;
};

GreyRange bulk_range(std::vector<double> values) {
  const auto at = [&](double share) {
    const auto place = values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
    std::nth_element(values.begin(), place, values.end());
    return *place;
  };
  return {at(outer_share), at(1 - outer_share)};
}

// Axes of the broad side: right, down, away from the origin, where the first camera stands.
Eigen::Matrix3d broad_side(const Cloud& cloud, const Eigen::Vector3d& centre) {
  Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
  for (const CloudPoint& point : cloud.points) {
    const Eigen::Vector3d d = point.position_mm - centre;
    scatter += d * d.transpose();
  }
  Eigen::Vector3d away = symmetric_eigen3(scatter).vectors.col(0);
  if (away.dot(centre) < 0) away = -away;
  // Upright: the frame's y is down, unless the cloud is looked at along it.
  Eigen::Vector3d down = Eigen::Vector3d::UnitY() - away.y() * away;
  if (down.norm() < 0.2) down = Eigen::Vector3d::UnitZ() - away.z() * away;
  down.normalize();
  Eigen::Matrix3d axes;
  axes.row(0) = down.cross(away);
  axes.row(1) = down;
  axes.row(2) = away;
  return axes;
}

struct Projected {
  Eigen::Vector2d pixel;
  double depth_mm;
};

Projected project(const CloudView& view, const Eigen::Vector3d& point) {
  const Eigen::Vector3d p = view.view_from_cloud * (point - view.centre_mm);
  return {view.px_per_mm * p.head<2>() + view.offset_px, p.z()};
}

// Calls visit(x, y, squared distance / radius^2) for the pixels within a splat.
template <typename Visit>
void for_pixels_around(const Eigen::Vector2d& pixel, double radius_px, cv::Size size, const Visit& visit) {
  const int left = std::max(0, static_cast<int>(std::ceil(pixel.x() - radius_px)));
  const int right = std::min(size.width - 1, static_cast<int>(std::floor(pixel.x() + radius_px)));
  const int top = std::max(0, static_cast<int>(std::ceil(pixel.y() - radius_px)));
  const int bottom = std::min(size.height - 1, static_cast<int>(std::floor(pixel.y() + radius_px)));
  for (int y = top; y <= bottom; ++y) {
    for (int x = left; x <= right; ++x) {
      const double share = (Eigen::Vector2d(x, y) - pixel).squaredNorm() / (radius_px * radius_px);
      if (share <= 1) visit(x, y, share);
    }
  }
}

// Wide enough for neighbouring points to overlap, taking them to be spread over the picture evenly.
double splat_radius_px(std::size_t points, cv::Size size) {
  const double area = 0.45 * size.area();
  return std::clamp(1.7 * std::sqrt(area / static_cast<double>(points)), 1.8, 12.0);
}

}  // namespace

CloudView choose_view(const Cloud& cloud, cv::Size size) {
  CloudView view;
  for (const CloudPoint& point : cloud.points) {
    view.centre_mm += point.position_mm / static_cast<double>(cloud.points.size());
  }
  view.view_from_cloud = Eigen::AngleAxisd(tilt_rad, Eigen::Vector3d::UnitX()).toRotationMatrix() *
                         Eigen::AngleAxisd(turn_rad, Eigen::Vector3d::UnitY()).toRotationMatrix() *
                         broad_side(cloud, view.centre_mm);
  std::vector<double> across, down;
  for (const CloudPoint& point : cloud.points) {
    const Eigen::Vector2d p = project(view, point.position_mm).pixel;
    across.push_back(p.x());
    down.push_back(p.y());
  }
  const GreyRange x = bulk_range(std::move(across));
  const GreyRange y = bulk_range(std::move(down));
  view.px_per_mm = std::min(size.width / std::max(1e-6, x.high - x.low), size.height / std::max(1e-6, y.high - y.low));
  view.offset_px = Eigen::Vector2d(size.width, size.height) / 2 -
                   view.px_per_mm * Eigen::Vector2d(x.low + x.high, y.low + y.high) / 2;
  return view;
}

CloudImage splat(const Cloud& cloud, const std::vector<float>& values, const CloudView& view, cv::Size size) {
  const double radius_px = splat_radius_px(cloud.points.size(), size);
  const double tolerance_mm = 3 * radius_px / view.px_per_mm;
  cv::Mat1d nearest(size, std::numeric_limits<double>::infinity());
  for (const CloudPoint& point : cloud.points) {
    const Projected p = project(view, point.position_mm);
    for_pixels_around(p.pixel, radius_px, size,
                      [&](int x, int y, double) { nearest(y, x) = std::min(nearest(y, x), p.depth_mm); });
  }
  CloudImage image{cv::Mat1f(size, 0.0F), cv::Mat1f(size, 0.0F), cv::Mat3f(size, cv::Vec3f(0, 0, 0))};
  for (std::size_t i = 0; i < cloud.points.size(); ++i) {
    const Projected p = project(view, cloud.points[i].position_mm);
    const Eigen::Vector3f normal = view.view_from_cloud.cast<float>() * cloud.points[i].normal;
    for_pixels_around(p.pixel, radius_px, size, [&](int x, int y, double share) {
      if (p.depth_mm > nearest(y, x) + tolerance_mm) return;
      const auto weight = static_cast<float>(std::exp(-3 * share));
      image.weight(y, x) += weight;
      image.value(y, x) += weight * values[i];
      for (int k = 0; k < 3; ++k) image.normal(y, x)[k] += weight * normal[k];
    });
  }
  for (int y = 0; y < size.height; ++y) {
    for (int x = 0; x < size.width; ++x) {
      if (image.weight(y, x) <= 0) continue;
      image.value(y, x) /= image.weight(y, x);
      const auto length = static_cast<float>(cv::norm(image.normal(y, x)));
      image.normal(y, x) = length > 1e-6F ? image.normal(y, x) / length : cv::Vec3f(0, 0, -1);
    }
  }
  return image;
}

}  // namespace crumple
