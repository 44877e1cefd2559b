// Gray decoding of one stripe orientation to whole stripes, by one of three rules for a bit.
//
// A bit is one where
//   paper    white - pattern < threshold                      (a fixed threshold; the reference method)
//   inverse  pattern > inverse                                (each pixel its own reference; needs inverse frames)
//   half     pattern > (white + black) / 2                    (without inverse frames)
// The rule's margin (the difference between both sides) tells how far a bit was from flipping. A pixel with one small
// margin lies on a stripe edge: Gray code changes one bit per boundary, so the error is at most one stripe, and such a
// pixel is the most informative one. It is therefore never rejected here; `weakest_margin` is there to be looked at.
//
// Not decoded (-1): pixels whose white-black contrast is below `lit_contrast`, mixed pixels (see below), and pixels
// whose code names no stripe of the panel.
#pragma once

#include <opencv2/core/mat.hpp>

#include "recon/stripe_images.h"

namespace crumple {

enum class BitRule { paper, inverse, half };

struct DecodeOptions {
  BitRule bit_rule = BitRule::inverse;
  double lit_contrast = 0.08;     // white - black, as a fraction of the sensor's range
  double paper_threshold = 0.12;  // white - pattern, as a fraction of the sensor's range
  // A pixel on a printed edge gets most of its light from its brighter neighbours and would report their coordinate. It
  // is left out where its contrast is below this fraction of the largest within 2 px. 0 keeps all.
  double mixed_ratio = 0.4;
};

// Lit and unmixed pixels (CV_8U, 255 or 0).
cv::Mat lit_mask(const StripeImages& images, const DecodeOptions& options);

struct DecodedStripes {
  cv::Mat stripe;          // CV_32S: the stripe's index k >= 0, or -1
  cv::Mat weakest_margin;  // CV_32F: the smallest margin over all bits, grey levels
};

// `lit` is a mask of the camera's size. Fails where the rule needs frames that are not there. Precondition:
// check_images(images) succeeded. The same bits come out at any thread count.
Expected<DecodedStripes> decode_stripes(const StripeImages& images, std::size_t stack, const cv::Mat& lit,
                                        const DecodeOptions& options);

}  // namespace crumple
