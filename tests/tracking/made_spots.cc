#include "tests/tracking/made_spots.h"

#include <algorithm>
#include <cmath>

namespace crumple {

SpotModel made_spot(double x, double y, double width_px, double peak) {
  return {{x, y}, width_px, peak * 2 * M_PI * width_px * width_px, 0};
}

cv::Mat made_spot_image(const std::vector<SpotModel>& spots, const MadeImageOptions& options, std::mt19937& random) {
  cv::Mat levels(options.height_px, options.width_px, CV_64F, cv::Scalar(options.background));
  for (SpotModel spot : spots) {
    spot.background = 0;
    const int reach = static_cast<int>(6 * spot.width_px + 2);
    const int x0 = static_cast<int>(spot.centre_px.x()), y0 = static_cast<int>(spot.centre_px.y());
    for (int y = std::max(0, y0 - reach); y <= std::min(levels.rows - 1, y0 + reach); ++y) {
      for (int x = std::max(0, x0 - reach); x <= std::min(levels.cols - 1, x0 + reach); ++x) {
        levels.at<double>(y, x) += spot_level(spot, x, y).level;
      }
    }
  }
  // What rounding to whole levels adds is part of the dark noise.
  const double read = std::sqrt(std::max(0.0, options.noise.dark * options.noise.dark - 1 / 12.0));
  std::normal_distribution<double> normal(0, 1);
  for (int y = 0; y < levels.rows; ++y) {
    for (int x = 0; x < levels.cols; ++x) {
      double& level = levels.at<double>(y, x);
      level += normal(random) * std::sqrt(read * read + options.noise.gain * level);
    }
  }
  cv::Mat image;
  levels.convertTo(image, options.depth, options.depth == CV_16U ? 256 : 1);
  return image;
}

}  // namespace crumple
