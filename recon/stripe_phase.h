// The stripe coordinate at every camera pixel, each from its own intensities (recon/stripe_fit.h), with its sigma.
//
// Per station and orientation: decode whole stripes; fit the blur and its change over the image on a sample of pixels
// (recon/blur_fit.h); fit every decoded pixel; then take out what systematic error the pixels show against each other
// (recon/phase_correction.h). No coordinate is smoothed over pixels.
//
// sigma: the noise of the differences is estimated from the fits' own residuals as a function of the gain, since light
// brings noise, and the pixels' scatter against their neighbours may enlarge or shrink all sigmas by one factor. How
// much a pixel's differences tell depends on its phase, which is taken from its neighbours
// (recon/phase_neighbourhoods.h). Where stripes are much wider than their blur, a pixel far from all boundaries knows
// no more than its stripe. Rejected: pixels whose residual squares exceed `gate` times what their gain's noise leads to
// expect, whose fit left the decoded stripe by more than two, or whose sigma exceeds `max_sigma`
// before what printed edges add to it.
#pragma once

#include <opencv2/core/mat.hpp>

#include "recon/blur_fit.h"
#include "recon/decode.h"
#include "recon/phase_correction.h"

namespace crumple {

struct PhaseOptions {
  double gate = 16;
  double max_sigma = 0.25;  // stripe widths; a whole stripe is known to 0.29
  bool correct = true;      // apply recon/phase_correction.h
};

// One orientation's coordinates over a camera image.
struct StripeCoordinates {
  cv::Mat coordinate_px;  // CV_64F, s = n . projector pixel; 0 where there is none
  cv::Mat sigma_px;       // CV_32F; 0 where there is no coordinate
  cv::Mat gain;           // CV_32F: half the difference pattern - inverse under full light, grey levels
  StripeModel model;
  PhaseCorrection correction;
};

// Preconditions: check_images(images) succeeded, `decoded` is of this stack. The same bits at any thread count.
StripeCoordinates estimate_stripe_phase(const StripeImages& images, std::size_t stack, const DecodedStripes& decoded,
                                        const PhaseOptions& options);

}  // namespace crumple
