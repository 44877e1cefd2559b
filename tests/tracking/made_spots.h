// Made images of light spots: Gaussians integrated over the pixels, with the camera's noise, in 8 bit.
#pragma once

#include <random>
#include <vector>

#include <opencv2/core/mat.hpp>

#include "tracking/spot_fit.h"

namespace crumple {

struct MadeImageOptions {
  int width_px = 320;
  int height_px = 240;
  double background = 8;
  LevelNoise noise = {};  // read noise besides the rounding, which comes by itself
  int depth = CV_8U;      // or CV_16U: 256 levels for each of 8 bit
};

// Each model's own background is ignored.
cv::Mat made_spot_image(const std::vector<SpotModel>& spots, const MadeImageOptions& options, std::mt19937& random);

// Of that peak level at the centre of a pixel, about.
SpotModel made_spot(double x, double y, double width_px, double peak);

}  // namespace crumple
