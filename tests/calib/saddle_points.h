// The detector with which the published calibration of OpenCV's stereo samples was made: its corners, for comparison.
#pragma once

#include <vector>

#include <Eigen/Core>
#include <opencv2/core/mat.hpp>

namespace crumple {

// 9 x 6 inner corners, 8-bit grey; empty where the board is not found.
std::vector<Eigen::Vector2d> by_saddle_points(const cv::Mat& image);

}  // namespace crumple
