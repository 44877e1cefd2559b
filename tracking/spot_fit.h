// A spot as a Gaussian, integrated over each pixel's square, on an even background; fitted to the pixels it lit.
//
//   level(u, v) = background + flux * P(u - x) P(v - y),   P(d) = Phi((d + 1/2) / s) - Phi((d - 1/2) / s)
//
// with Phi the normal distribution function and s the spot's width, px. The integral matters: a Gaussian sampled at the
// pixels' centres is off for spots narrower than a pixel. Pixel coordinates as in solvers/lens.h.
#pragma once

#include <vector>

#include <Eigen/Core>

#include "solvers/expected.h"

namespace crumple {

// x, y (px), width s (px), flux (levels times px^2), background (levels): the order of all derivatives.
struct SpotModel {
  Eigen::Vector2d centre_px = Eigen::Vector2d::Zero();
  double width_px = 1;
  double flux = 0;
  double background = 0;
};

struct SpotLevel {
  double level = 0;
  Eigen::Matrix<double, 1, 5> derivative;
};

SpotLevel spot_level(const SpotModel& model, int u, int v);

struct SpotSample {
  int u = 0;
  int v = 0;
  double level = 0;
};

// The variance of a level, levels^2, is dark^2 + gain * level: read noise and rounding, and the light's own.
struct LevelNoise {
  double dark = 0.6;
  double gain = 0.02;
};

struct SpotFit {
  SpotModel model;
  Eigen::Matrix2d covariance_px2;  // of the centre; enlarged where the model explains the levels worse than the noise
  double chi_square = 0;
  int redundancy = 0;
};

// Levenberg-Marquardt on the levels, weighted by the noise of the level that the model has (fixed after the first
// steps). Fails with fewer than seven samples and where the fit runs away: to a width below 0.2 px or above
// `largest_width_px`, more than 2 px off the start, or to no light.
Expected<SpotFit> fit_spot(const std::vector<SpotSample>& samples, const SpotModel& start, const LevelNoise& noise,
                           double largest_width_px);

}  // namespace crumple
