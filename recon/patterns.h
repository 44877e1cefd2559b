// Gray-code stripe patterns at any set of orientations.
//
// An orientation has the unit normal n = (cos a, sin a) in the projector's pixel plane, a from the x axis towards y:
// a = 0 makes columns (the coordinate runs along x), a = 90 deg rows. The stripe coordinate of a projector pixel p is
// s = n . p. Stripe k covers [origin + k w, origin + (k + 1) w), w the stripe width and origin the smallest s over the
// panel's outer edge (pixel corners, so -0.5 for columns and rows). Stripe k shows the Gray code g(k + code_offset),
// g(i) = i xor (i >> 1), most significant bit first; its inverse shows the complement.
#pragma once

#include <vector>

#include <Eigen/Core>
#include <opencv2/core/mat.hpp>

#include "solvers/expected.h"
#include "solvers/lens.h"

namespace crumple {

struct StripeOrientation {
  double angle_rad = 0;
  double stripe_width_px = 1;
  int bits = 10;
  int code_offset = 0;
  bool inverse = true;  // whether every pattern is followed by its complement

  Eigen::Vector2d normal() const;
};

// The smallest stripe coordinate on the panel, and the number of stripes that cover it.
double stripe_origin_px(const StripeOrientation& orientation, ImageSize projector);
int stripe_count(const StripeOrientation& orientation, ImageSize projector);

// Fails where the bits cannot name every stripe of the panel, or a number makes no sense (width <= 0, bits > 16).
Expected<StripeOrientation> checked(const StripeOrientation& orientation, ImageSize projector);

// A chessboard to be cast: inner corners on the panel, in projector pixels. The square outside corner 0 is dark, and
// what lies around the squares is lit. Its edges fall between pixels, as they should, where first_corner_px ends on a
// half and pitch_px is whole.
struct ProjectedChessboard {
  int columns = 0;
  int rows = 0;
  Eigen::Vector2d first_corner_px = Eigen::Vector2d::Zero();
  double pitch_px = 0;

  // Corner `index` runs along rows first: index = row * columns + column.
  Eigen::Vector2d corner_px(int index) const {
    return first_corner_px + pitch_px * Eigen::Vector2d(index % columns, index / columns);
  }
};

unsigned gray_from_binary(unsigned i);
unsigned binary_from_gray(unsigned g);

// The 8-bit image (0 or 255) of one bit, 0 the most significant. A pixel is lit where its centre falls in a lit stripe.
cv::Mat draw_stripes(const StripeOrientation& orientation, ImageSize projector, int bit, bool inverted);

}  // namespace crumple
