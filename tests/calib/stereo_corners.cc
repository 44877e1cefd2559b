#include "tests/calib/stereo_corners.h"

#include <map>
#include <tuple>

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

const std::vector<Eigen::Vector2d>& stereo_corners(const Capture& capture, const std::string& camera,
                                                   const std::string& station, CornerDetector detect) {
  static std::map<std::tuple<CornerDetector, std::string, std::string>, std::vector<Eigen::Vector2d>> found;
  const auto [corners, missing] = found.try_emplace({detect, camera, station});
  if (missing) corners->second = detect(read_board_image(capture, camera, station).value());
  return corners->second;
}

}  // namespace crumple
