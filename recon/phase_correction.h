// Two systematic errors of decoded stripe coordinates, estimated from the coordinates themselves and taken out.
//
// 1. Phase error: where the assumed blur differs from the true one, the coordinate is off by a function of its phase
//    within the stripes. It is modelled as a short Fourier series with periods of 1, 1/2, 2 and 4 stripes, whose
//    coefficients vary over the image (tiles, bilinear in between) as focus does.
// 2. Mixed reflectance: a pixel on a brightness gradient sees the stripes not at its centre but displaced towards the
//    brighter side, for a Gaussian camera blur by exactly sigma_camera^2 grad(log C) (Stein's lemma; C the contrast).
//    The one unknown is sigma_camera^2. At printed edges the gradient is the pixel's own, as the geometric mean of the
//    two differences to its neighbours, since it changes several times over within a pixel; shading, which one pixel's
//    noise hides, is the mean over 7 x 7 pixels without an edge.
//
// On a surface that is smooth over three to five pixels, the second differences of the coordinate along camera rows and
// columns hold nothing but noise and the second differences of these errors: a linear least-squares problem. Broken
// surfaces fall to its outlier gate; where there is too little to see (few pixels, a coordinate that advances by whole
// stripes per pixel), a prior of zero keeps the corrections away. Coordinates are corrected, never averaged.
#pragma once

#include <array>

#include <opencv2/core/mat.hpp>

#include "recon/phase_neighbourhoods.h"
#include "recon/tile_map.h"

namespace crumple {

struct PhaseCorrection {
  static constexpr int kTerms = 8;

  // sin, cos of 2 pi u f for f = 1, 2, 1/2, 1/4 cycles per stripe; in stripe widths.
  std::array<double, kTerms> mean{};
  TileMap local;           // the same terms as they vary over the image
  double mixing_px2 = 0;   // sigma_camera^2, camera pixels squared
  double sigma_scale = 1;  // observed over predicted scatter of second differences
};

// `u`: CV_64F stripe widths from the origin; `sigma`: CV_32F of u, 0 where there is no coordinate; `contrast`: CV_32F,
// grey levels. `mean`: of u as it is given, sigma 0 where sigma is. Corrects u, scales sigma, and adds to it a quarter
// of what mixing could do by the steepest change of brightness next to the pixel in any direction: what the
// one-Gaussian model leaves, and what it cannot know of a pixel that sees its surface in part.
PhaseCorrection correct_phase(cv::Mat& u, cv::Mat& sigma, const cv::Mat& contrast, const PhaseNeighbourhoods& mean);

}  // namespace crumple
