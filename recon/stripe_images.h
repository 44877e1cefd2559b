// One camera's frames of one stripe sequence at one station.
#pragma once

#include <span>
#include <vector>

#include <opencv2/core/mat.hpp>

#include "recon/patterns.h"

namespace crumple {

// All images are single-channel, of one size and one depth (CV_8U or CV_16U).
struct StripeStack {
  StripeOrientation orientation;
  std::vector<cv::Mat> patterns;  // orientation.bits images, most significant bit first
  std::vector<cv::Mat> inverses;  // as many, or none where orientation.inverse is false
};

struct StripeImages {
  ImageSize projector;
  std::vector<StripeStack> stacks;
  cv::Mat white;  // the scene under full projector light
  cv::Mat black;  // the scene with the projector dark; empty where it was not taken
};

// Fails where sizes, depths or counts do not fit together, or an orientation cannot be decoded.
Expected<void> check_images(const StripeImages& images);

// The number of grey levels above zero that the depth can hold: 255 or 65535.
double full_range(const cv::Mat& image);

// One row as numbers, whichever the depth.
void read_row(const cv::Mat& image, int y, std::span<float> row);

// White minus black in grey levels (CV_32F, not below 0). Where there is no black frame the darkest of all the stripe
// frames at each pixel stands in for it.
cv::Mat contrast_image(const StripeImages& images);

}  // namespace crumple
