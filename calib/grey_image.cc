#include "calib/grey_image.h"

#include <algorithm>

#include <opencv2/core.hpp>

namespace crumple {

cv::Mat to_8_bit(const cv::Mat& image) {
  if (image.depth() == CV_8U) return image;
  double smallest = 0, largest = 0;
  cv::minMaxLoc(image, &smallest, &largest);
  const double scale = 255 / std::max(largest - smallest, 1.0);
  cv::Mat image8;
  image.convertTo(image8, CV_8U, scale, -smallest * scale);
  return image8;
}

}  // namespace crumple
