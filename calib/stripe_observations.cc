#include "calib/stripe_observations.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include <Eigen/Cholesky>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>

namespace crumple {
namespace {

constexpr float kVague = 2;  // times the view's median sigma

// The pixel of a cell with the smallest positive sigma; the first of equals.
std::optional<cv::Point> best_in(const cv::Mat& sigma, const cv::Mat& mask, const cv::Rect& cell) {
  std::optional<cv::Point> best;
  float smallest = 0;
  for (int y = cell.y; y < cell.y + cell.height; ++y) {
    for (int x = cell.x; x < cell.x + cell.width; ++x) {
      const float s = sigma.at<float>(y, x);
      if (mask.at<std::uint8_t>(y, x) == 0 || s <= 0 || (best && s >= smallest)) continue;
      best = cv::Point(x, y);
      smallest = s;
    }
  }
  return best;
}

template <typename Use>
void for_each_cell(const cv::Mat& hull, int spacing, const Use& use) {
  const cv::Rect box = cv::boundingRect(hull);
  for (int y = box.y; y < box.y + box.height; y += spacing) {
    for (int x = box.x; x < box.x + box.width; x += spacing) use(cv::Rect(x, y, spacing, spacing) & box);
  }
}

// The projector pixel from the readings of all orientations at a camera pixel.
std::optional<Eigen::Vector2d> projector_pixel(const BoardStripes& stripes, const cv::Point& at) {
  Eigen::Matrix2d normal = Eigen::Matrix2d::Zero();
  Eigen::Vector2d right = Eigen::Vector2d::Zero();
  for (std::size_t o = 0; o < stripes.readings.orientations.size(); ++o) {
    if (stripes.readings.coordinates[o].sigma_px.at<float>(at) <= 0) continue;
    const Eigen::Vector2d n = stripes.readings.orientations[o].normal();
    normal += n * n.transpose();
    right += n * stripes.readings.coordinates[o].coordinate_px.at<double>(at);
  }
  if (normal.determinant() < 0.1) return std::nullopt;
  return normal.llt().solve(right);
}

void drop_gross_errors(PixelPairs& pairs, double tolerance_px) {
  std::vector<cv::Point2d> camera, projector;
  for (std::size_t i = 0; i < pairs.camera_pixels.size(); ++i) {
    camera.emplace_back(pairs.camera_pixels[i].x(), pairs.camera_pixels[i].y());
    projector.emplace_back(pairs.projector_pixels[i].x(), pairs.projector_pixels[i].y());
  }
  if (camera.size() < 4) return;
  std::vector<std::uint8_t> kept;
  cv::findHomography(camera, projector, kept, cv::RANSAC, tolerance_px);
  if (kept.size() != camera.size()) return;
  PixelPairs good = pairs;
  good.camera_pixels.clear();
  good.projector_pixels.clear();
  for (std::size_t i = 0; i < kept.size(); ++i) {
    if (kept[i] == 0) continue;
    good.camera_pixels.push_back(pairs.camera_pixels[i]);
    good.projector_pixels.push_back(pairs.projector_pixels[i]);
  }
  pairs = std::move(good);
}

// A cell in a dark square has but the pixels on the square's printed edge.
void drop_vague(const std::vector<float>& sigmas, StripeView& view) {
  if (sigmas.empty()) return;
  std::vector<float> sorted = sigmas;
  const auto middle = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2);
  std::nth_element(sorted.begin(), middle, sorted.end());
  std::size_t kept = 0;
  for (std::size_t i = 0; i < sigmas.size(); ++i) {
    if (sigmas[i] > kVague * *middle) continue;
    view.camera_pixels[kept] = view.camera_pixels[i];
    view.coordinates_px[kept] = view.coordinates_px[i];
    ++kept;
  }
  view.camera_pixels.resize(kept);
  view.coordinates_px.resize(kept);
}

}  // namespace

cv::Mat corner_hull(const std::vector<Eigen::Vector2d>& corners, cv::Size size) {
  std::vector<cv::Point> points, hull;
  for (const Eigen::Vector2d& c : corners) {
    points.emplace_back(static_cast<int>(std::lround(c.x())), static_cast<int>(std::lround(c.y())));
  }
  cv::convexHull(points, hull);
  cv::Mat mask = cv::Mat::zeros(size, CV_8U);
  cv::fillConvexPoly(mask, hull, 255);
  return mask;
}

std::vector<StripeView> stripe_views(const BoardStripes& stripes, const cv::Mat& hull, const ThinningOptions& options) {
  std::vector<StripeView> views;
  for (std::size_t o = 0; o < stripes.readings.orientations.size(); ++o) {
    StripeView view{
        stripes.camera, stripes.projector, stripes.placement, stripes.readings.orientations[o].normal(), {}, {}};
    const StripeCoordinates& read = stripes.readings.coordinates[o];
    std::vector<float> sigmas;
    for_each_cell(hull, options.spacing_px, [&](const cv::Rect& cell) {
      const auto at = best_in(read.sigma_px, hull, cell);
      if (!at) return;
      view.camera_pixels.emplace_back(at->x, at->y);
      view.coordinates_px.push_back(read.coordinate_px.at<double>(*at));
      sigmas.push_back(read.sigma_px.at<float>(*at));
    });
    drop_vague(sigmas, view);
    if (!view.coordinates_px.empty()) views.push_back(std::move(view));
  }
  return views;
}

PixelPairs pixel_pairs(const BoardStripes& stripes, const cv::Mat& hull, const ThinningOptions& options) {
  PixelPairs pairs{stripes.camera, stripes.projector, stripes.placement, {}, {}};
  if (stripes.readings.orientations.empty()) return pairs;
  for_each_cell(hull, options.pair_spacing_px, [&](const cv::Rect& cell) {
    const auto at = best_in(stripes.readings.coordinates.front().sigma_px, hull, cell);
    const auto pixel = at ? projector_pixel(stripes, *at) : std::nullopt;
    if (!pixel) return;
    pairs.camera_pixels.emplace_back(at->x, at->y);
    pairs.projector_pixels.push_back(*pixel);
  });
  drop_gross_errors(pairs, options.pair_tolerance_px);
  return pairs;
}

}  // namespace crumple
