// The stripe coordinate of one pixel from its own intensities in all bits: maximum likelihood under equal, independent
// Gaussian noise of the differences D_b = pattern_b - inverse_b,
//   minimise over (u, g):  sum_b (D_b - g (d_b(u) + offset_b))^2,
// started from the whole-stripe code. The gain g is eliminated (it is linear), u found on a grid and then by
// Gauss-Newton. Every bit contributes: the one whose boundary is near most, the others little.
#pragma once

#include "recon/stripe_response.h"

namespace crumple {

struct StripeFit {
  double u = 0;            // stripe widths from the origin
  double gain = 0;         // grey levels
  double information = 0;  // var(u) = var(D) / information; 0 where u is not determined
  double squares = 0;      // sum of squared residuals, grey levels squared
};

// `offsets` in units of the contrast. `reach` is how far from `start` the grid looks, in stripe widths; 0 goes straight
// to Gauss-Newton.
StripeFit fit_stripe(const StripeTable& table, const BitVector& offsets, const BitVector& differences, double start,
                     double reach);

// The information of a fit that would have ended at u with that gain.
double stripe_information(const StripeTable& table, const BitVector& offsets, double u, double gain);

}  // namespace crumple
