#include "recon/patterns.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <fmt/format.h>

namespace crumple {
namespace {

// cos and sin of a right angle carry rounding of 6e-17, which would tilt rows by that much and add a stripe.
double without_rounding(double x) { return std::abs(x) < 1e-15 ? 0.0 : x; }

struct Span {
  double lowest;
  double highest;
};

// Stripe coordinates at the panel's outer edge, which lies half a pixel outside the outermost pixel centres.
Span span_of_panel(const StripeOrientation& orientation, ImageSize projector) {
  const Eigen::Vector2d n = orientation.normal();
  const std::array<double, 2> along_x = {-0.5 * n.x(), (projector.width_px - 0.5) * n.x()};
  const std::array<double, 2> along_y = {-0.5 * n.y(), (projector.height_px - 0.5) * n.y()};
  return {std::min(along_x[0], along_x[1]) + std::min(along_y[0], along_y[1]),
          std::max(along_x[0], along_x[1]) + std::max(along_y[0], along_y[1])};
}

}  // namespace

Eigen::Vector2d StripeOrientation::normal() const {
  return {without_rounding(std::cos(angle_rad)), without_rounding(std::sin(angle_rad))};
}

double stripe_origin_px(const StripeOrientation& orientation, ImageSize projector) {
  return span_of_panel(orientation, projector).lowest;
}

int stripe_count(const StripeOrientation& orientation, ImageSize projector) {
  const Span span = span_of_panel(orientation, projector);
  // A last stripe thinner than rounding is none.
  return static_cast<int>(std::ceil((span.highest - span.lowest) / orientation.stripe_width_px - 1e-9));
}

Expected<StripeOrientation> checked(const StripeOrientation& orientation, ImageSize projector) {
  const double degrees = orientation.angle_rad * 180 / M_PI;
  if (projector.width_px <= 0 || projector.height_px <= 0) {
    return fail(fmt::format("the projector's size {} x {} is not positive: give its panel's pixel counts",
                            projector.width_px, projector.height_px));
  }
  if (!std::isfinite(orientation.angle_rad)) return fail("a stripe orientation's angle is not a number");
  if (!std::isfinite(orientation.stripe_width_px) || orientation.stripe_width_px <= 0) {
    return fail(fmt::format("the stripe width {} px of orientation {:.6g} deg is not positive",
                            orientation.stripe_width_px, degrees));
  }
  if (orientation.bits < 1 || orientation.bits > 16) {
    return fail(fmt::format("orientation {:.6g} deg has {} bits: 1 to 16 can be decoded", degrees, orientation.bits));
  }
  if (orientation.code_offset < 0) {
    return fail(
        fmt::format("the code offset {} of orientation {:.6g} deg is negative", orientation.code_offset, degrees));
  }
  const double stripes = std::hypot(projector.width_px, projector.height_px) / orientation.stripe_width_px;
  const int codes = 1 << orientation.bits;
  // The first comparison keeps the count within an int.
  if (stripes > 1e6 || stripe_count(orientation, projector) + orientation.code_offset > codes) {
    return fail(fmt::format(
        "{} bits with code offset {} cannot name the {:.6g} px wide stripes of orientation {:.6g} deg on a {} x {} "
        "panel: use more bits, wider stripes or a smaller offset",
        orientation.bits, orientation.code_offset, orientation.stripe_width_px, degrees, projector.width_px,
        projector.height_px));
  }
  return orientation;
}

unsigned gray_from_binary(unsigned i) { return i ^ (i >> 1); }

unsigned binary_from_gray(unsigned g) {
  for (unsigned shift = 16; shift > 0; shift /= 2) g ^= g >> shift;
  return g;
}

cv::Mat draw_stripes(const StripeOrientation& orientation, ImageSize projector, int bit, bool inverted) {
  const Eigen::Vector2d n = orientation.normal();
  const double origin = stripe_origin_px(orientation, projector);
  const unsigned mask = 1U << (orientation.bits - 1 - bit);
  cv::Mat image(projector.height_px, projector.width_px, CV_8U);
  for (int y = 0; y < image.rows; ++y) {
    auto* row = image.ptr<std::uint8_t>(y);
    for (int x = 0; x < image.cols; ++x) {
      const double stripe = std::floor((n.x() * x + n.y() * y - origin) / orientation.stripe_width_px);
      const auto code = static_cast<unsigned>(static_cast<int>(stripe) + orientation.code_offset);
      const bool lit = (gray_from_binary(code) & mask) != 0;
      row[x] = lit != inverted ? 255 : 0;
    }
  }
  return image;
}

}  // namespace crumple
