// Coded markers in an image, matched with those of a target.
#pragma once

#include <array>
#include <vector>

#include <Eigen/Core>
#include <opencv2/core/mat.hpp>

#include "calib/target.h"
#include "solvers/expected.h"

namespace crumple {

struct SeenMarker {
  std::size_t index = 0;                   // into markers_of(target)
  std::array<Eigen::Vector2d, 4> corners;  // px, in the order of marker_corners_mm; to a pixel or so
};

// Ascending by index, each once. At least one; else the reason. `image8` is CV_8U.
Expected<std::vector<SeenMarker>> see_markers(const cv::Mat& image8, const Target& target);

}  // namespace crumple
