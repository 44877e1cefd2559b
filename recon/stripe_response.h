// What a camera pixel sees of blurred stripes: the signal of every bit as a function of the stripe coordinate.
//
// Signal of bit b at the position u (stripe widths from the origin):
//   d_b(u) = (pattern - inverse) / (their contrast) = [stripes_b * blur](u) + offset_b
// stripes_b is +1 in lit and -1 in dark stripes and 0 beyond the panel. The blur is a sum of Gaussians, so each stripe
// boundary becomes a sum of error functions: a sharp core (defocus of both lenses, the pixels' size), a skirt
// (aberrations) and a wide halo (light scattered in the lenses and the surface). offset_b is the difference of the lamp
// between the pattern's frame and its inverse's. A free gain per pixel takes the surface's brightness.
#pragma once

#include <array>
#include <functional>
#include <vector>

#include <Eigen/Core>
#include <opencv2/core/mat.hpp>

#include "recon/patterns.h"

namespace crumple {

// Widths are standard deviations in stripe widths; shares are fractions of the light, the core has the rest.
struct StripeBlur {
  double core = 0.6;
  double skirt = 2.5;
  double skirt_share = 0.1;
  double halo_share = 0.05;
  static constexpr double kHalo = 50;
};

// The Fourier transform of the blur at a frequency in cycles per stripe, and its derivatives with respect to
// (log core, log skirt, skirt_share, halo_share).
double blur_transfer(const StripeBlur& blur, double frequency);
std::array<double, 4> d_blur_transfer(const StripeBlur& blur, double frequency);

// One number per bit, the most significant first; beyond the last bit all are zero.
using BitVector = Eigen::Matrix<float, 16, 1>;

// Stripe signals sampled finely, ready for interpolation.
class StripeTable {
 public:
  struct Sample {
    BitVector value;
    BitVector slope;  // with respect to u
  };
  Sample at(double u) const;
  const BitVector& nearest(double u) const;

 private:
  friend class StripeSpectrum;
  static constexpr int kSamplesPerStripe = 32;
  static constexpr int kMargin = 16;  // stripes beyond the panel on either side
  std::size_t sample_below(double position) const;

  std::vector<BitVector> values_;
};

// The Fourier transforms of the unblurred stripes of all bits.
class StripeSpectrum {
 public:
  StripeSpectrum(const StripeOrientation& orientation, ImageSize projector);
  StripeTable blurred(const std::function<double(double frequency)>& transfer) const;

 private:
  int bits_;
  int samples_;
  cv::Mat spectrum_;  // one row per bit
};

}  // namespace crumple
