// Grey images as detectors take them.
#pragma once

#include <cstdint>

#include <opencv2/core/mat.hpp>

namespace crumple {

// CV_8U as it is; CV_16U stretched from its smallest to its largest value.
cv::Mat to_8_bit(const cv::Mat& image);

// Of a CV_8U or CV_16U image.
inline double intensity_at(const cv::Mat& image, int x, int y) {
  return image.depth() == CV_8U ? image.at<std::uint8_t>(y, x) : image.at<std::uint16_t>(y, x);
}

}  // namespace crumple
