#include "recon/smooth.h"

#include <gtest/gtest.h>

#include "tests/recon/made_surfaces.h"

namespace crumple {
namespace {

const Eigen::Vector3d overhead(0, 0, 600);

double bowl(double x, double y) { return (x * x + y * y) / 200; }

// RMS height over the surface away from its border, where the polynomial reaches beyond the points.
double rms_inside(const Cloud& cloud) {
  double sum = 0;
  int count = 0;
  for (const CloudPoint& point : cloud.points) {
    const Eigen::Vector3d& p = point.position_mm;
    if (p.head<2>().cwiseAbs().maxCoeff() > 12) continue;
    sum += std::pow(p.z() - bowl(p.x(), p.y()), 2);
    ++count;
  }
  return std::sqrt(sum / count);
}

TEST(Smooth, TakesNoiseOffACurvedSurfaceAndLeavesItsShape) {
  const Cloud noisy = made_surface(bowl, 15, 0.5, overhead, 0.05, 1);
  const SmoothedCloud smooth = smoothed(noisy, {overhead}, {.radius_mm = 2});
  EXPECT_NEAR(rms_inside(noisy), 0.05, 0.002);
  EXPECT_LT(rms_inside(smooth.cloud), 0.025);
  EXPECT_EQ(smooth.left_alone, 0U);
  const Cloud exact = made_surface(bowl, 15, 0.5, overhead, 0, 1);
  EXPECT_LT(rms_inside(smoothed(exact, {overhead}, {.radius_mm = 2}).cloud), 5e-4);
  EXPECT_EQ(smooth.cloud.points[77].sigma_mm, noisy.points[77].sigma_mm);
}

TEST(Smooth, NormalsAreThePolynomialsTowardsTheStation) {
  Cloud cloud = made_surface(bowl, 10, 0.5, overhead, 0.001, 2);
  for (CloudPoint& point : cloud.points) point.normal.setZero();
  for (const double side : {1.0, -1.0}) {
    for (const CloudPoint& point : smoothed(cloud, {side * overhead}, {.radius_mm = 2}).cloud.points) {
      const Eigen::Vector3d& p = point.position_mm;
      const Eigen::Vector3d truth = side * Eigen::Vector3d(-p.x() / 100, -p.y() / 100, 1).normalized();
      EXPECT_GT(point.normal.cast<double>().dot(truth), 0.9999);
    }
  }
}

TEST(Smooth, PointsWithFewNeighboursStay) {
  Cloud cloud = made_surface(bowl, 5, 0.5, overhead, 0.01, 3);
  CloudPoint lone;
  lone.position_mm = {0, 0, 50};
  cloud.points.push_back(lone);
  const SmoothedCloud smooth = smoothed(cloud, {overhead}, {.radius_mm = 2});
  EXPECT_EQ(smooth.left_alone, 1U);
  EXPECT_EQ(smooth.cloud.points.back().position_mm, lone.position_mm);
}

TEST(Smooth, SameAtAnyNumberOfThreads) {
  const Cloud cloud = made_surface(bowl, 15, 0.5, overhead, 0.05, 4);
  const Cloud one = smoothed(cloud, {overhead}, {.threads = 1}).cloud,
              three = smoothed(cloud, {overhead}, {.threads = 3}).cloud;
  for (std::size_t i = 0; i < one.points.size(); ++i) {
    EXPECT_EQ(one.points[i].position_mm, three.points[i].position_mm);
  }
}

}  // namespace
}  // namespace crumple
