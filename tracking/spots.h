// Light spots in one grey image of a tracker camera.
//
//   1. Background and its noise: medians and quantiles of square blocks, interpolated (as star catalogues are made:
//      Bertin & Arnouts, A&A Suppl. 117, 1996). Bright spots do not lift a median.
//   2. Pixels brighter than the background by a threshold, joined through edges and corners.
//   3. The centre of gravity of each one's light above the background: the measurement of the paper that the system
//      follows. It is drawn to the pixels' grid, and by saturation.
//   4. A Gaussian on the pixel grid (tracking/spot_fit.h), saturated pixels left out, with its covariance.
//
// Pixel (0, 0) is the centre of the top-left pixel. Grey levels are the image's own, 8 or 16 bit. What is bright but no
// spot is returned with the reason.
#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>
#include <opencv2/core/mat.hpp>

#include "solvers/expected.h"
#include "tracking/spot_fit.h"

namespace crumple {

struct SpotOptions {
  double contrast = 0.06;           // the least above the background, as a share of the image's range
  double noise_sigmas = 6;          // and in units of the background's noise
  double saturation = 0.98;         // share of the image's range from which on a pixel is not trusted
  int block_px = 32;                // of the background, 8 or more
  int fewest_pixels = 3;            // fewer are a hot pixel
  int most_pixels = 400;            // more are a lamp or a window
  double largest_elongation = 2.0;  // ratio of the axes of its second moments
  double largest_width_px = 6;      // of the Gaussian
  LevelNoise noise = {};            // in levels of 8 bit; of other ranges it is scaled
};

struct Spot {
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();  // of the Gaussian
  Eigen::Matrix2d covariance_px2 = Eigen::Matrix2d::Identity();
  Eigen::Vector2d centre_of_gravity_px = Eigen::Vector2d::Zero();
  double width_px = 0;
  double peak = 0;  // above the background, levels, as the image has it
  int pixels = 0;   // above the threshold
  int saturated = 0;
};

enum class SpotRefusal { hot_pixel, too_big, at_the_edge, elongated, no_spot };
const char* words(SpotRefusal refusal);

struct RefusedSpot {
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();
  SpotRefusal refusal = SpotRefusal::no_spot;
};

struct SpotsFound {
  std::vector<Spot> spots;  // by rows of their topmost pixel
  std::vector<RefusedSpot> refused;
};

// Fails on an image that is empty or not one channel of 8 or 16 bit.
Expected<SpotsFound> find_spots(const cv::Mat& image, const SpotOptions& options = {});

}  // namespace crumple
