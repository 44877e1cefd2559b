// A camera's image with its residuals drawn into it, enlarged.
#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>
#include <opencv2/core/mat.hpp>

namespace crumple {

struct ResidualArrow {
  Eigen::Vector2d pixel;        // where it was measured
  Eigen::Vector2d residual_px;  // predicted minus measured
  bool accepted = true;
};

// What the arrows are, and what the one in the corner shows.
struct OverlayLegend {
  std::string title;
  const char* arrows = "residuals";
  const char* typical = "one sigma";
};

// 8 bit, colour. `image` is CV_8U or CV_16U and becomes the dimmed background, small ones magnified; accepted residuals
// are green, outliers red. The enlargement, the same for all images that are to be compared, is stated in a corner,
// with an arrow of `typical_px`.
cv::Mat residual_overlay(const cv::Mat& image, const std::vector<ResidualArrow>& arrows, double enlargement,
                         double typical_px, const OverlayLegend& legend);

// The enlargement, of 1, 2, 5, 10, 20 ..., at which a residual of `sigma_px` is about a sixtieth of the image wide.
double enlargement_for(double sigma_px, int image_width_px);

}  // namespace crumple
