// Camera images of stripes on a tilted plane, made by area sampling: square projector pixels, box-shaped camera
// pixels, many samples each. Nothing here shares the estimator's model of blur.
#pragma once

#include <functional>
#include <vector>

#include <Eigen/Core>
#include <opencv2/core/mat.hpp>

#include "recon/stripe_images.h"

namespace crumple {

Eigen::Vector2d tilted_plane(const Eigen::Vector2d& camera_pixel);

struct StripeScene {
  ImageSize projector{128, 96};
  cv::Size camera{160, 120};
  // Which projector pixel lights what a camera pixel sees; a tilted plane by default.
  std::function<Eigen::Vector2d(const Eigen::Vector2d&)> projector_from_camera = tilted_plane;
  double projector_blur_px = 0.9;  // full width of a box, twice (a triangle)
  double camera_blur_px = 1.0;     // full width of the camera pixel's box
  double white = 130;
  double black = 10;
  double noise = 0;  // grey levels, standard deviation
  unsigned seed = 1;
  cv::Mat reflectance;  // CV_32F at 4 x the camera's resolution; empty is 1 everywhere
};

StripeImages render_stripes(const StripeScene& scene, const std::vector<StripeOrientation>& orientations);

// The true stripe coordinate at a camera pixel's centre.
double true_coordinate(const StripeScene& scene, const StripeOrientation& orientation, int x, int y);

}  // namespace crumple
