#include <cmath>
#include <numbers>

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include "datasets/render/light.h"

namespace crumple {
namespace {

// Each projector pixel sends out the same flux: its area on a tilted plane times the irradiance there does not depend
// on the pixel or on the tilt.
TEST(RenderLight, irradiance_conserves_the_flux_of_every_pixel) {
  constexpr double focal_px = 1500;
  constexpr double reference_mm = 800;
  const Eigen::Vector3d normal = Eigen::Vector3d(0.3, -0.4, -1).normalized();
  const Eigen::Vector3d on_plane(20, -30, 700);
  const auto met = [&](double x, double y) -> Eigen::Vector3d {
    const Eigen::Vector3d ray(x / focal_px, y / focal_px, 1);
    return ray * (normal.dot(on_plane) / normal.dot(ray));
  };
  for (const double x : {-600.0, 0.0, 450.0}) {
    for (const double y : {-300.0, 200.0}) {
      const Eigen::Vector3d a = met(x - 0.5, y - 0.5);
      const double area = (met(x + 0.5, y - 0.5) - a).cross(met(x - 0.5, y + 0.5) - a).norm();
      const Eigen::Vector3d centre = met(x, y);
      const double cosine = -normal.dot(centre.normalized());
      const double flux = area * projector_irradiance(centre, cosine, reference_mm);
      EXPECT_NEAR(flux / std::pow(reference_mm / focal_px, 2), 1, 2e-3);
    }
  }
}

// Light is neither made nor lost by looking from the other end (Helmholtz), and a coat reflects less than it receives.
TEST(RenderLight, reflectance_is_reciprocal_and_loses_energy) {
  const Material coat{0, 0.6, 0.3};
  const Eigen::Vector3d normal(0, 0, -1);
  const Eigen::Vector3d light = Eigen::Vector3d(0.5, 0.2, -1).normalized();
  const Eigen::Vector3d viewer = Eigen::Vector3d(-0.3, 0.1, -1).normalized();
  EXPECT_NEAR(reflectance(coat, normal, light, viewer), reflectance(coat, normal, viewer, light), 1e-12);
  EXPECT_EQ(reflectance(coat, normal, -light, viewer), 0);

  double reflected = 0;
  constexpr int steps = 400;
  for (int i = 0; i < steps; ++i) {
    const double polar = (i + 0.5) * std::numbers::pi / 2 / steps;
    for (int j = 0; j < steps; ++j) {
      const double turn = (j + 0.5) * 2 * std::numbers::pi / steps;
      const Eigen::Vector3d out(std::sin(polar) * std::cos(turn), std::sin(polar) * std::sin(turn), -std::cos(polar));
      const double solid_angle = std::sin(polar) * (std::numbers::pi / 2 / steps) * (2 * std::numbers::pi / steps);
      reflected += reflectance(coat, normal, light, out) / std::numbers::pi * std::cos(polar) * solid_angle;
    }
  }
  EXPECT_LT(reflected, 0.65);
  EXPECT_GT(reflected, 0.5);
}

TEST(RenderLight, pixel_spread_shares_all_light_among_the_pixels) {
  for (const double fill : {1.0, 0.8}) {
    const PixelSpread spread(fill, 0.6);
    for (const double at : {0.0, 0.13, 0.5}) {
      double total = 0;
      for (int pixel = -8; pixel <= 8; ++pixel) total += spread.weight(at - pixel);
      EXPECT_NEAR(total, 1, fill == 1 ? 1e-4 : 2e-2);
    }
  }
  const PixelSpread sharp(1, 0);
  EXPECT_EQ(sharp.weight(0.49), 1);
  EXPECT_EQ(sharp.weight(0.51), 0);
}

}  // namespace
}  // namespace crumple
