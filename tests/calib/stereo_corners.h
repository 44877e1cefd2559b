// Detectors for OpenCV's stereo samples: ours, and the one with which their published calibration was made.
#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>
#include <opencv2/core/mat.hpp>

#include "datasets/capture.h"

namespace crumple {

// 9 x 6 inner corners, 8-bit grey; empty where the board is not found. In single precision, all that OpenCV's
// calibration takes: both are to fit the same numbers.
std::vector<Eigen::Vector2d> by_crossing_edges(const cv::Mat& image);
std::vector<Eigen::Vector2d> by_saddle_points(const cv::Mat& image);

// Of one image of the capture. Found once in a process: that takes longer than what is tested.
using CornerDetector = std::vector<Eigen::Vector2d> (*)(const cv::Mat& image);
const std::vector<Eigen::Vector2d>& stereo_corners(const Capture& capture, const std::string& camera,
                                                   const std::string& station, CornerDetector detect);

}  // namespace crumple
