// How blurred the stripes are at this station, from the stripe frames themselves.
//
// Least squares over a sample of pixels: the differences of all bits against the blurred-stripe model, with each
// pixel's own coordinate and gain projected out (variable projection). Shares and offsets are one for the station and
// orientation; the width of the core, which changes with focus, also varies over the image. A weak prior holds what few
// bits cannot tell.
#pragma once

#include <span>
#include <vector>

#include "recon/stripe_fit.h"
#include "recon/tile_map.h"

namespace crumple {

struct PixelSignal {
  int x = 0;
  int y = 0;
  double start = 0;  // stripe widths from the origin, from whole-stripe decoding
  BitVector differences = BitVector::Zero();
};

struct StripeModel {
  StripeBlur blur;
  BitVector offsets = BitVector::Zero();
  std::vector<StripeTable> tables;  // of cores blur.core * 2^((i - middle) / 16)
  TileMap level;                    // which of the tables, fractional

  const StripeTable& table_at(int x, int y) const;
};

// With no pixels the prior's blur comes back.
StripeModel fit_stripe_model(const StripeOrientation& orientation, ImageSize projector, cv::Size camera,
                             std::span<const PixelSignal> pixels);

}  // namespace crumple
