// Stripe boundaries found between neighbouring camera pixels, at the zero crossing of pattern minus inverse.
//
// In Gray code every boundary k between stripes k - 1 and k belongs to exactly one bit; its coordinate is known
// exactly, s = origin + k w. Between two neighbouring pixels (along a camera row or column) whose codes differ by
// exactly that boundary, the crossing of d = (pattern - inverse) / contrast is interpolated linearly. Zero stays zero
// under any monotone camera response; dividing by the contrast keeps a printed edge from moving it.
#pragma once

#include <vector>

#include <Eigen/Core>

#include "recon/decode.h"

namespace crumple {

struct StripeEdgeOptions {
  // Pairs whose contrasts differ by more than this factor lie across a printed edge and are left out.
  double contrast_ratio = 1.3;
  double max_sigma_px = 0.3;  // of the crossing
};

struct StripeCrossing {
  Eigen::Vector2d camera_pixel;
  Eigen::Vector2d direction;  // (1, 0) or (0, 1): where along the crossing was interpolated
  double coordinate_px = 0;   // exact, of the boundary
  double sigma_px = 0;        // of camera_pixel along direction: noise over slope
};

// Row by row, along x before along y. The noise comes from the data: pattern + inverse is the same in every bit, so its
// scatter over the bits is noise (with no inverse frames, only rounding can be assumed). Preconditions:
// check_images(images) succeeded, `decoded` is of this stack.
std::vector<StripeCrossing> find_stripe_edges(const StripeImages& images, std::size_t stack,
                                              const DecodedStripes& decoded, const StripeEdgeOptions& options);

}  // namespace crumple
