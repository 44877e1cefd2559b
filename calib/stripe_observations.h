// Decoded stripes on the board as observations for the refinement.
//
// A board carries some hundred thousand decoded pixels against a few dozen corners. Their errors are not independent: a
// sheet that is not flat and a stripe model that is not exact push neighbours the same way. So only one reading per
// square cell of `spacing_px` camera pixels is taken, the one with the smallest sigma (readings are never averaged; a
// cell whose best is more than twice as vague as the view's median has none), and what correlation remains is met by an
// effective number (calib/correlation.h).
#pragma once

#include <vector>

#include <opencv2/core/mat.hpp>

#include "calib/initial_rig.h"
#include "recon/station.h"
#include "solvers/observations.h"

namespace crumple {

// The stripes one camera decoded at one placement.
struct BoardStripes {
  std::size_t camera = 0;
  std::size_t projector = 0;
  std::size_t placement = 0;
  StationReadings readings;
};

struct ThinningOptions {
  int spacing_px = 12;           // cells for the refinement
  int pair_spacing_px = 24;      // cells for the projector's start
  double pair_tolerance_px = 6;  // from one homography over the board; beyond it a pair is a decoding error
};

// Pixels inside the convex hull of the corners: 255, elsewhere 0.
cv::Mat corner_hull(const std::vector<Eigen::Vector2d>& corners, cv::Size size);

// One view per orientation, each in the hull; orientations without a reading are left out.
std::vector<StripeView> stripe_views(const BoardStripes& stripes, const cv::Mat& hull, const ThinningOptions& options);

// Pixels with readings in at least two orientations, as camera-projector pairs without gross errors.
PixelPairs pixel_pairs(const BoardStripes& stripes, const cv::Mat& hull, const ThinningOptions& options);

}  // namespace crumple
