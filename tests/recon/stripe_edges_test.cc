#include "recon/stripe_edges.h"

#include <cmath>

#include <gtest/gtest.h>
#include <opencv2/core.hpp>

#include "tests/recon/synthetic_stripes.h"

namespace crumple {
namespace {

const StripeOrientation kSevenBits{.bits = 7};

std::vector<StripeCrossing> crossings(const StripeImages& images) {
  const auto decoded = decode_stripes(images, 0, lit_mask(images, {}), {});
  return find_stripe_edges(images, 0, *decoded, {});
}

// How far the true boundary is from the crossing, in camera pixels along its direction.
double error_px(const StripeScene& scene, const StripeCrossing& c) {
  const auto coordinate = [&](const Eigen::Vector2d& p) {
    return kSevenBits.normal().dot(scene.projector_from_camera(p));
  };
  const double s = coordinate(c.camera_pixel);
  return (c.coordinate_px - s) / (coordinate(c.camera_pixel + c.direction) - s);
}

bool near_border(const StripeScene& scene, const StripeCrossing& c) {
  const auto& p = c.camera_pixel;
  return p.x() < 3 || p.y() < 3 || p.x() > scene.camera.width - 4 || p.y() > scene.camera.height - 4;
}

TEST(StripeEdges, LieOnTheTrueBoundaries) {
  const StripeScene scene;
  const auto found = crossings(render_stripes(scene, {kSevenBits}));
  EXPECT_GT(found.size(), 70U * 120U);
  double squares = 0;
  int n = 0;
  for (const StripeCrossing& c : found) {
    // Rows of the camera run along the stripes, nearly: there the slope is too small to judge.
    if (near_border(scene, c) || c.direction.x() == 0) continue;
    EXPECT_DOUBLE_EQ(c.coordinate_px - std::floor(c.coordinate_px), 0.5);
    squares += std::pow(error_px(scene, c), 2);
    ++n;
  }
  EXPECT_LT(std::sqrt(squares / n), 0.06);
}

TEST(StripeEdges, PredictedSigmaIsTheScatterThatNoiseAdds) {
  StripeScene scene;
  scene.noise = 4;
  double standardised = 0;
  int n = 0;
  for (const StripeCrossing& c : crossings(render_stripes(scene, {kSevenBits}))) {
    if (near_border(scene, c) || c.direction.x() == 0) continue;
    standardised += std::pow(error_px(scene, c) / c.sigma_px, 2);
    ++n;
  }
  EXPECT_GT(std::sqrt(standardised / n), 0.85);
  EXPECT_LT(std::sqrt(standardised / n), 1.3);  // linear interpolation adds its own
}

TEST(StripeEdges, NoneAcrossAPrintedEdge) {
  StripeScene scene;
  scene.reflectance = cv::Mat(4 * scene.camera.height, 4 * scene.camera.width, CV_32F, cv::Scalar(1));
  scene.reflectance.colRange(4 * 80, scene.reflectance.cols) = 0.6F;
  int far_away = 0;
  for (const StripeCrossing& c : crossings(render_stripes(scene, {kSevenBits}))) {
    EXPECT_FALSE(c.direction.x() > 0 && std::abs(c.camera_pixel.x() - 79.5) < 0.5);
    if (c.camera_pixel.x() > 90) ++far_away;
  }
  EXPECT_GT(far_away, 1000);
}

}  // namespace
}  // namespace crumple
