// The signal of a stripe sequence, row by row: pattern - inverse, or 2 pattern - white - black where there are no
// inverse frames. All bits of a pixel lie together.
#pragma once

#include <span>
#include <vector>

#include <opencv2/core/mat.hpp>

#include "recon/stripe_images.h"
#include "recon/stripe_response.h"

namespace crumple {

class DifferenceRows {
 public:
  // Refers to all three, which must outlive it. `contrast` is contrast_image(images).
  DifferenceRows(const StripeImages& images, const StripeStack& stack, const cv::Mat& contrast);

  void read(int y);
  std::span<const float> pixel(int x) const;  // of the row read last: one difference per bit, grey levels
  BitVector bits(int x) const;                // the same, padded with zeros

 private:
  const StripeImages& images_;
  const StripeStack& stack_;
  const cv::Mat& contrast_;
  std::vector<float> row_, other_, differences_;
};

}  // namespace crumple
