#include "recon/map_image.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <optional>

#include <Eigen/Geometry>
#include <opencv2/imgproc.hpp>

namespace crumple {
namespace {

constexpr double kPointsPerCell = 6;
constexpr double kLeastCosine = 0.1;  // more grazing views show more of the lens's blur than of the point
constexpr double kLeastStep_mm = 2;   // what lies that close behind is the same surface
constexpr double kSlope = 4;          // how steep a surface may be, in cells of depth a cell

struct Seen {
  Eigen::Vector2d pixel;
  double depth_mm = 0;
  double cosine = 0;
};

std::optional<Seen> seen_by(const Lens& lens, const Pose& camera_from_cloud, const CloudPoint& point) {
  const Eigen::Vector3d in_camera = camera_from_cloud * point.position_mm;
  const auto pixel = lens.project(in_camera);
  if (!pixel || pixel->x() < 0 || pixel->y() < 0 || pixel->x() > lens.size().width_px - 1 ||
      pixel->y() > lens.size().height_px - 1) {
    return std::nullopt;
  }
  // A point without a normal is taken to face the camera.
  const Eigen::Vector3d normal = camera_from_cloud.rotation * point.normal.cast<double>();
  const double cosine = point.normal.isZero() ? 1 : -normal.dot(in_camera.normalized());
  if (cosine < kLeastCosine) return std::nullopt;
  return Seen{*pixel, in_camera.norm(), cosine};
}

// The nearest depth of each cell of the image.
class DepthCells {
 public:
  DepthCells(const ImageSize& size, const std::vector<std::optional<Seen>>& points) {
    Eigen::AlignedBox2d reach;
    double count = 0;
    for (const auto& point : points) {
      if (!point) continue;
      reach.extend(point->pixel);
      ++count;
    }
    const double area_px2 = count > 0 ? reach.sizes().prod() : 1;
    cell_px_ = std::max(1.0, std::sqrt(kPointsPerCell * area_px2 / std::max(count, 1.0)));
    columns_ = static_cast<std::size_t>(size.width_px / cell_px_) + 1;
    nearest_.assign(columns_ * (static_cast<std::size_t>(size.height_px / cell_px_) + 1),
                    std::numeric_limits<double>::infinity());
    for (const auto& point : points) {
      if (point) nearest_[cell_of(point->pixel)] = std::min(nearest_[cell_of(point->pixel)], point->depth_mm);
    }
  }

  bool hides(const Seen& point, double focal_px) const {
    const double cell_mm = cell_px_ * point.depth_mm / focal_px;
    return point.depth_mm > nearest_[cell_of(point.pixel)] + std::max(kLeastStep_mm, kSlope * cell_mm);
  }

 private:
  std::size_t cell_of(const Eigen::Vector2d& pixel) const {
    return static_cast<std::size_t>(pixel.y() / cell_px_) * columns_ + static_cast<std::size_t>(pixel.x() / cell_px_);
  }

  double cell_px_ = 1;
  std::size_t columns_ = 1;
  std::vector<double> nearest_;
};

}  // namespace

ImageMapper::ImageMapper(const Cloud& cloud)
    : cloud_(cloud), sums_(cloud.points.size()), weights_(cloud.points.size()), views_(cloud.points.size()) {}

void ImageMapper::add(const cv::Mat& image, const Lens& lens, const Pose& camera_from_cloud) {
  assert(image.cols == lens.size().width_px && image.rows == lens.size().height_px && image.channels() == 1);
  cv::Mat1f levels, level;
  image.convertTo(levels, CV_32F);
  std::vector<std::optional<Seen>> points;
  points.reserve(cloud_.points.size());
  for (const CloudPoint& point : cloud_.points) points.push_back(seen_by(lens, camera_from_cloud, point));
  const DepthCells cells(lens.size(), points);
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (!points[i] || cells.hides(*points[i], lens.parameters()[0])) continue;
    cv::getRectSubPix(levels, {1, 1},
                      {static_cast<float>(points[i]->pixel.x()), static_cast<float>(points[i]->pixel.y())}, level);
    sums_[i] += points[i]->cosine * level(0, 0);
    weights_[i] += points[i]->cosine;
    ++views_[i];
  }
}

std::vector<float> ImageMapper::values() const {
  std::vector<float> values(sums_.size());
  for (std::size_t i = 0; i < sums_.size(); ++i) {
    values[i] = weights_[i] > 0 ? static_cast<float>(sums_[i] / weights_[i]) : 0;
  }
  return values;
}

}  // namespace crumple
