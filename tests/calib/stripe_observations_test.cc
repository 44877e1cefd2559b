#include "calib/stripe_observations.h"

#include <gtest/gtest.h>
#include <opencv2/core.hpp>

namespace crumple {
namespace {

// One orientation over a small image; sigma is `sigma_px` but in one cell, which has no better pixel than `vague_px`.
StripeView view_with_a_vague_cell(float sigma_px, float vague_px) {
  constexpr int kImage_px = 48;
  StripeCoordinates read;
  read.coordinate_px = cv::Mat(kImage_px, kImage_px, CV_64F, cv::Scalar(7));
  read.sigma_px = cv::Mat(kImage_px, kImage_px, CV_32F, cv::Scalar(sigma_px));
  read.sigma_px(cv::Rect(12, 24, 12, 12)) = vague_px;
  read.sigma_px.at<float>(3, 5) = 0.9F * sigma_px;
  BoardStripes stripes;
  stripes.readings.orientations = {StripeOrientation{.bits = 6}};
  stripes.readings.coordinates = {read};
  const cv::Mat hull(kImage_px, kImage_px, CV_8U, cv::Scalar(255));
  return stripe_views(stripes, hull, {.spacing_px = 12}).at(0);
}

TEST(StripeObservations, ACellHasItsPixelOfLeastSigma) {
  const StripeView view = view_with_a_vague_cell(0.02F, 0.03F);
  ASSERT_EQ(view.camera_pixels.size(), 16);
  EXPECT_EQ(view.camera_pixels.front(), Eigen::Vector2d(5, 3));
}

TEST(StripeObservations, ACellThatHasOnlyVaguePixelsHasNone) {
  const StripeView view = view_with_a_vague_cell(0.02F, 0.05F);
  EXPECT_EQ(view.camera_pixels.size(), 15);
  EXPECT_EQ(view.coordinates_px.size(), 15);
  for (const Eigen::Vector2d& pixel : view.camera_pixels) {
    EXPECT_FALSE(
        cv::Rect(12, 24, 12, 12).contains(cv::Point(static_cast<int>(pixel.x()), static_cast<int>(pixel.y()))));
  }
}

}  // namespace
}  // namespace crumple
