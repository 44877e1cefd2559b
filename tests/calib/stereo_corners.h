// Detectors for OpenCV's stereo samples: ours, and the one with which their published calibration was made.
#pragma once

#include <vector>

#include <Eigen/Core>
#include <opencv2/core/mat.hpp>

namespace crumple {

// 9 x 6 inner corners, 8-bit grey; empty where the board is not found. In single precision, all that OpenCV's
// calibration takes: both are to fit the same numbers.
std::vector<Eigen::Vector2d> by_crossing_edges(const cv::Mat& image);
std::vector<Eigen::Vector2d> by_saddle_points(const cv::Mat& image);

}  // namespace crumple
