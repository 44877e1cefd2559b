#include "calib/projected_board.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>
#include <opencv2/imgproc.hpp>

#include "calib/detect_board.h"
#include "calib/target_print.h"
#include "solvers/closed_form/homography.h"

namespace crumple {
namespace {

constexpr std::size_t kFewestProjected = 8;
constexpr double kBrightShare = 0.98;    // of the pixels are no brighter than a bright place
constexpr float kLeastQuotient = 0.02F;  // of a bright place's light: with less, a quotient is noise
constexpr float kLeastBright = 0.25F;    // of a bright place's light, around a corner that is used
constexpr float kLeastEven = 0.6F;       // darkest over brightest around a corner that is used
constexpr double kDarkCode = 40;         // of the quotient 0
constexpr double kLightCode = 200;       // of the quotient 1
constexpr double kReachOfSquare = 0.25;  // how far around a corner the print matters
constexpr double kShortestReach_px = 3;

float bright_level(const cv::Mat1f& image) {
  std::vector<float> values(image.begin(), image.end());
  const auto place = static_cast<std::ptrdiff_t>(kBrightShare * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), values.begin() + place, values.end());
  return values[static_cast<std::size_t>(place)];
}

cv::Mat1f light_of(const cv::Mat& image, const cv::Mat& black) {
  cv::Mat1f light;
  image.convertTo(light, CV_32F);
  if (!black.empty()) {
    cv::Mat1f dark;
    black.convertTo(dark, CV_32F);
    light -= dark;
  }
  return light;
}

// 255 inside the outline of everything printed.
Expected<cv::Mat> printed_area(const Target& target, const CornerView& printed, cv::Size size) {
  const Board board = board_of(target);
  std::vector<Eigen::Vector2d> on_board;
  for (const int corner : printed.corners) on_board.emplace_back(board.point(corner).head<2>());
  const auto pixel_from_board = homography(on_board, printed.pixels);
  if (!pixel_from_board) return tl::unexpected(pixel_from_board.error());
  const auto [low, high] = TargetPrint(target).extent();
  std::vector<cv::Point> outline;
  for (const auto& [x, y] :
       {std::pair{low.x(), low.y()}, {high.x(), low.y()}, {high.x(), high.y()}, {low.x(), high.y()}}) {
    const Eigen::Vector2d pixel = apply_homography(*pixel_from_board, {x, y});
    outline.emplace_back(static_cast<int>(std::lround(pixel.x())), static_cast<int>(std::lround(pixel.y())));
  }
  cv::Mat mask(size, CV_8U, cv::Scalar(0));
  cv::fillConvexPoly(mask, outline, cv::Scalar(255));
  return mask;
}

// The projection alone, 8 bit, and how much light the plate returns where it is fully lit.
struct Separated {
  cv::Mat projection;
  cv::Mat1f reflected;
};

Separated print_divided_out(const cv::Mat1f& light, const cv::Mat1f& full) {
  const float least = kLeastQuotient * bright_level(full);
  Separated separated{cv::Mat(light.size(), CV_8U, cv::Scalar(kLightCode)), full};
  for (int y = 0; y < light.rows; ++y) {
    for (int x = 0; x < light.cols; ++x) {
      if (!(full(y, x) > least)) continue;
      const double quotient = std::clamp(light(y, x) / full(y, x), 0.0F, 1.2F);
      separated.projection.at<std::uint8_t>(y, x) =
          cv::saturate_cast<std::uint8_t>(kDarkCode + (kLightCode - kDarkCode) * quotient);
    }
  }
  return separated;
}

Separated print_painted_over(const cv::Mat1f& light, const cv::Mat& squares) {
  const float bright = bright_level(light);
  cv::Mat1f painted = light.clone();
  painted.setTo(bright, squares);
  cv::Mat projection;
  painted.convertTo(projection, CV_8U, kLightCode / std::max(bright, 1.0F));
  cv::Mat1f reflected(light.size(), 1.0F);
  reflected.setTo(0.0F, squares);
  return {projection, reflected};
}

// How far around a corner the print matters: a share of the square at the middle of the grid.
int reach_px(const DetectedBoard& found, int columns) {
  double shortest = 1e9;
  for (std::size_t i = 0; i + 1 < found.corners.size(); ++i) {
    const bool neighbours = found.corners[i + 1] == found.corners[i] + 1 && found.corners[i + 1] % columns != 0;
    if (neighbours) shortest = std::min(shortest, (found.pixels[i + 1] - found.pixels[i]).norm());
  }
  return static_cast<int>(std::lround(std::max(kShortestReach_px, kReachOfSquare * shortest)));
}

bool evenly_light(const cv::Mat1f& reflected, float bright, const Eigen::Vector2d& pixel, int reach) {
  const int x = static_cast<int>(std::lround(pixel.x())), y = static_cast<int>(std::lround(pixel.y()));
  const cv::Rect around =
      cv::Rect(x - reach, y - reach, 2 * reach + 1, 2 * reach + 1) & cv::Rect({0, 0}, reflected.size());
  if (around.empty()) return false;
  double darkest = 0, brightest = 0;
  cv::minMaxLoc(reflected(around), &darkest, &brightest);
  return darkest >= kLeastBright * bright && darkest >= kLeastEven * brightest;
}

}  // namespace

Expected<ProjectedCorners> detect_projected_board(const ProjectedBoardImages& images,
                                                  const ProjectedChessboard& chessboard, const Target& target,
                                                  const CornerView& printed) {
  const cv::Mat1f light = light_of(images.chessboard, images.black);
  Separated separated;
  if (images.white.empty()) {
    const auto squares = printed_area(target, printed, light.size());
    if (!squares) return tl::unexpected(squares.error());
    separated = print_painted_over(light, *squares);
  } else {
    separated = print_divided_out(light, light_of(images.white, images.black));
  }
  const auto found = detect_grid(separated.projection, chessboard.columns, chessboard.rows);
  if (!found) return fail("the projected chessboard: " + found.error().message);

  cv::Mat1f smooth;  // one noisy pixel is not the print
  cv::blur(separated.reflected, smooth, {3, 3});
  const float bright = bright_level(smooth);
  const int reach = reach_px(*found, chessboard.columns);
  ProjectedCorners corners;
  for (std::size_t i = 0; i < found->corners.size(); ++i) {
    if (!evenly_light(smooth, bright, found->pixels[i], reach)) continue;
    corners.projector_pixels.push_back(chessboard.corner_px(found->corners[i]));
    corners.camera_pixels.push_back(found->pixels[i]);
  }
  if (corners.camera_pixels.size() < kFewestProjected) {
    return fail(
        fmt::format("the projected chessboard: {} of its {} corners lie on evenly white plate, {} are needed: "
                    "let it reach further beyond the print",
                    corners.camera_pixels.size(), found->corners.size(), kFewestProjected));
  }
  return corners;
}

}  // namespace crumple
