#include "calib/detect_dots.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include <Eigen/LU>
#include <fmt/format.h>
#include <opencv2/calib3d.hpp>
#include <opencv2/features2d.hpp>

#include "calib/grey_image.h"
#include "calib/seeded_dice.h"
#include "solvers/closed_form/homography.h"
#include "solvers/decompositions.h"

namespace crumple {
namespace {

constexpr double kLeastArea_px2 = 12;
constexpr double kAstray = 0.25;  // of the distance between neighbours: no dot of this grid
constexpr double kWindow = 0.6;   // of the way from a dot's edge to halfway to the next dot
constexpr int kCentreIterations = 4;
constexpr double kFarthest = 0.5;  // of a radius, from where OpenCV put it

cv::Ptr<cv::FeatureDetector> blob_detector(const cv::Mat& image8, const Target& target) {
  cv::SimpleBlobDetector::Params params;
  params.minThreshold = 20;
  params.maxThreshold = 230;
  params.thresholdStep = 15;
  params.minArea = kLeastArea_px2;
  params.maxArea = static_cast<float>(image8.total()) / static_cast<float>(target.columns * target.rows);
  params.minDistBetweenBlobs = 5;
  params.minCircularity = 0.6F;
  params.filterByCircularity = true;
  params.minInertiaRatio = 0.15F;
  params.minConvexity = 0.85F;
  return cv::SimpleBlobDetector::create(params);
}

std::optional<Points2d> find_grid(const cv::Mat& image8, const Target& target) {
  const int layout = target.staggered ? cv::CALIB_CB_ASYMMETRIC_GRID : cv::CALIB_CB_SYMMETRIC_GRID;
  for (const int method : {0, int{cv::CALIB_CB_CLUSTERING}}) {
    const SeededDice dice(1);
    std::vector<cv::Point2f> centres;
    if (!cv::findCirclesGrid(image8, {target.columns, target.rows}, centres, layout | method,
                             blob_detector(image8, target))) {
      continue;
    }
    Points2d points;
    for (const cv::Point2f& centre : centres) points.emplace_back(centre.x, centre.y);
    return points;
  }
  return std::nullopt;
}

Points2d mirrored(const Points2d& points, int columns) {
  Points2d result;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const std::size_t width = static_cast<std::size_t>(columns);
    result.push_back(points[i / width * width + (width - 1 - i % width)]);
  }
  return result;
}

double worst_error_px(const Eigen::Matrix3d& h, const Points2d& on_board, const Points2d& pixels) {
  double worst = 0;
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    worst = std::max(worst, (apply_homography(h, on_board[i]) - pixels[i]).norm());
  }
  return worst;
}

struct PlacedDots {
  Points2d pixels;  // by board index
  Eigen::Matrix3d pixel_from_board;
};

// The order in which the dots are the target's, seen from its front, with x to the right where that leaves a choice.
std::optional<PlacedDots> place(const Points2d& found, const Board& board, int columns) {
  std::optional<PlacedDots> best;
  for (const bool mirror : {false, true}) {
    for (const bool turn : {false, true}) {
      Points2d pixels = mirror ? mirrored(found, columns) : found;
      if (turn) std::reverse(pixels.begin(), pixels.end());
      const auto h = homography(board.nominal_mm(), pixels);
      if (!h) continue;
      const Eigen::Vector2d origin = apply_homography(*h, {0, 0});
      const Eigen::Vector2d x = apply_homography(*h, {2 * board.disc_radius_mm(), 0}) - origin;
      const Eigen::Vector2d y = apply_homography(*h, {0, 2 * board.disc_radius_mm()}) - origin;
      if (x.x() * y.y() - x.y() * y.x() <= 0) continue;
      if (worst_error_px(*h, board.nominal_mm(), pixels) > kAstray * (pixels[1] - pixels[0]).norm()) continue;
      if (!best || x.x() > 0) best = PlacedDots{pixels, *h};
    }
  }
  return best;
}

struct Pixel {
  Eigen::Vector2d at;
  double intensity;
  double distance;  // on the board, over the radius
};

// The pixels around a dot out to halfway to the next one. None where they leave the image.
std::vector<Pixel> pixels_around(const cv::Mat& image, const Eigen::Vector2d& centre,
                                 const Eigen::Matrix2d& radii_from_px, double reach) {
  const Eigen::Matrix2d px_from_radii = radii_from_px.inverse();
  const Eigen::Vector2d half(reach * px_from_radii.row(0).norm(), reach * px_from_radii.row(1).norm());
  const Eigen::Vector2d low = (centre - half).array().floor(), high = (centre + half).array().ceil();
  if (low.x() < 0 || low.y() < 0 || high.x() > image.cols - 1 || high.y() > image.rows - 1) return {};
  std::vector<Pixel> pixels;
  for (int y = static_cast<int>(low.y()); y <= static_cast<int>(high.y()); ++y) {
    for (int x = static_cast<int>(low.x()); x <= static_cast<int>(high.x()); ++x) {
      const Eigen::Vector2d at(x, y);
      const double distance = (radii_from_px * (at - centre)).norm();
      if (distance <= reach) pixels.push_back({at, intensity_at(image, x, y), distance});
    }
  }
  return pixels;
}

// The sheet's brightness, a plane over the pixels around `centre`, from those beyond the window.
std::optional<Eigen::Vector3d> white_around(const std::vector<Pixel>& pixels, const Eigen::Vector2d& centre,
                                            double window) {
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
  int count = 0;
  for (const Pixel& pixel : pixels) {
    if (pixel.distance < window) continue;
    const Eigen::Vector3d row(1, pixel.at.x() - centre.x(), pixel.at.y() - centre.y());
    normal += row * row.transpose();
    right += pixel.intensity * row;
    ++count;
  }
  if (count < 12) return std::nullopt;
  return Eigen::Vector3d(solve_symmetric(normal, right));
}

std::optional<Eigen::Vector2d> centre_of_gravity(const cv::Mat& image, const Eigen::Vector2d& start,
                                                 const Eigen::Matrix2d& radii_from_px, double reach) {
  const double window = 1 + kWindow * (reach - 1);
  Eigen::Vector2d centre = start;
  for (int i = 0; i < kCentreIterations; ++i) {
    const std::vector<Pixel> pixels = pixels_around(image, centre, radii_from_px, reach);
    const auto white = white_around(pixels, centre, window);
    if (!white) return std::nullopt;
    double sum = 0;
    Eigen::Vector2d moment = Eigen::Vector2d::Zero();
    for (const Pixel& pixel : pixels) {
      if (pixel.distance >= window) continue;
      const Eigen::Vector2d offset = pixel.at - centre;
      const double taken = 1 - pixel.intensity / ((*white)[0] + white->tail<2>().dot(offset));
      sum += taken;
      moment += taken * offset;
    }
    if (!(sum > 0)) return std::nullopt;
    centre += moment / sum;
    if (!((radii_from_px * (centre - start)).norm() < kFarthest)) return std::nullopt;
  }
  return centre;
}

// Half the distance to the nearest dot, over the radius.
double reach_of(const Board& board) {
  double nearest = std::numeric_limits<double>::infinity();
  const auto& points = board.nominal_mm();
  for (std::size_t i = 1; i < points.size(); ++i) nearest = std::min(nearest, (points[i] - points[0]).norm());
  return 0.5 * nearest / board.disc_radius_mm();
}

// From pixels about a dot to its radii, affine.
Eigen::Matrix2d radii_from_px(const Eigen::Matrix3d& h, const Eigen::Vector2d& nominal_mm, double radius_mm) {
  Eigen::Matrix2d px_from_radii;
  for (int axis = 0; axis < 2; ++axis) {
    const Eigen::Vector2d step = radius_mm * Eigen::Vector2d::Unit(axis);
    px_from_radii.col(axis) = 0.5 * (apply_homography(h, nominal_mm + step) - apply_homography(h, nominal_mm - step));
  }
  return px_from_radii.inverse();
}

}  // namespace

Expected<DetectedBoard> detect_dots(const cv::Mat& image, const Target& target) {
  try {
    const auto found = find_grid(to_8_bit(image), target);
    if (!found) {
      return fail(fmt::format(
          "no grid of {} x {}{} dots found: all of it must be in view, for a part without markers cannot be told from "
          "another",
          target.columns, target.rows, target.staggered ? " staggered" : ""));
    }
    const Board nominal = board_of(target);
    const auto placed = place(*found, nominal, target.columns);
    if (!placed) {
      return fail(
          fmt::format("dots were found, but not where a grid of {} x {} has them", target.columns, target.rows));
    }
    DetectedBoard board;
    for (int i = 0; i < nominal.point_count(); ++i) {
      const std::size_t k = static_cast<std::size_t>(i);
      const auto centre =
          centre_of_gravity(image, placed->pixels[k],
                            radii_from_px(placed->pixel_from_board, nominal.nominal_mm()[k], nominal.disc_radius_mm()),
                            reach_of(nominal));
      if (!centre) {
        ++board.unrefined;
        continue;
      }
      board.corners.push_back(i);
      board.pixels.push_back(*centre);
    }
    if (2 * board.unrefined > nominal.point_count()) {
      return fail(fmt::format("{} of the {} dots are too close to the image's border, or too faint", board.unrefined,
                              nominal.point_count()));
    }
    return board;
  } catch (const cv::Exception& error) {
    return fail(fmt::format("the dot detector failed: {}", error.err));
  }
}

}  // namespace crumple
