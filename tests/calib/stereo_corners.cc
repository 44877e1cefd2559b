#include "tests/calib/stereo_corners.h"

#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>

#include "calib/detect_board.h"

namespace crumple {

std::vector<Eigen::Vector2d> by_crossing_edges(const cv::Mat& image) {
  const auto board = detect_grid(image, 9, 6);
  if (!board) return {};
  std::vector<Eigen::Vector2d> pixels;
  for (const Eigen::Vector2d& pixel : board->pixels) {
    pixels.emplace_back(static_cast<float>(pixel.x()), static_cast<float>(pixel.y()));
  }
  return pixels;
}

std::vector<Eigen::Vector2d> by_saddle_points(const cv::Mat& image) {
  std::vector<cv::Point2f> corners;
  if (!cv::findChessboardCorners(image, {9, 6}, corners)) return {};
  cv::cornerSubPix(image, corners, {11, 11}, {-1, -1},
                   cv::TermCriteria(cv::TermCriteria::COUNT + cv::TermCriteria::EPS, 30, 0.01));
  std::vector<Eigen::Vector2d> pixels;
  for (const cv::Point2f& c : corners) pixels.emplace_back(c.x, c.y);
  return pixels;
}

}  // namespace crumple
