// One camera's frames of one stripe sequence at one station.
#pragma once

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

}  // namespace crumple
