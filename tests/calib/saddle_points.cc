#include "tests/calib/saddle_points.h"

#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>

namespace crumple {

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
