#include "recon/triangulate.h"

#include <cmath>

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

namespace crumple {
namespace {

Lens projector() {
  return *Lens::create("LENSMODEL_OPENCV5", {1024, 768}, {1890, 1894, 501, 857, -0.11, 0.08, 0.002, -0.001, 0.01});
}

Pose proj_from_cam() { return {rotation_from_vector({-0.2, 0.03, 0.01}), {95, -620, -240}}; }

double uniform(double low, double high) { return low + (high - low) * *rc::gen::inRange(0, 1000001) * 1e-6; }

RC_GTEST_PROP(Triangulate, IsExactOnNoiseFreeCoordinatesOfADistortedLens, ()) {
  const Eigen::Vector3d ray(uniform(-0.15, 0.15), uniform(-0.12, 0.12), 1);
  const double depth = uniform(2500, 4500);
  const double angle = uniform(0.6, 2.5);
  const StripeTriangulator triangulate(projector(), proj_from_cam(), {std::cos(angle), std::sin(angle)});
  const double s = *triangulate.coordinate_px(ray, depth);
  const auto found = triangulate(ray, s);
  RC_ASSERT(found.has_value());
  RC_ASSERT(std::abs(found->depth_mm - depth) < 1e-9 * depth);
  const double h = 0.1;
  const double rate =
      (*triangulate.coordinate_px(ray, depth + h) - *triangulate.coordinate_px(ray, depth - h)) / (2 * h);
  RC_ASSERT(std::abs(found->d_depth_d_coordinate * rate - 1) < 1e-5);
}

TEST(Triangulate, NothingBehindTheSensorsOrWithoutParallax) {
  const StripeTriangulator rows(projector(), proj_from_cam(), {0, 1});
  const Eigen::Vector3d ray(0, 0, 1);
  EXPECT_TRUE(rows(ray, *rows.coordinate_px(ray, 3000)));
  const double at_infinity = *rows.coordinate_px(ray, 1e12);
  const double towards_near = *rows.coordinate_px(ray, 1e6) - at_infinity;
  EXPECT_FALSE(rows(ray, at_infinity - 1000 * towards_near));
  // Side by side with no rotation, rows run along the epipolar lines.
  const StripeTriangulator blind(projector(), Pose{Eigen::Quaterniond::Identity(), {100, 0, 0}}, {0, 1});
  EXPECT_FALSE(blind(ray, 857));
}

TEST(Triangulate, AverageIsPlainAndItsSigmaFollows) {
  const DepthReading readings[] = {{1000, 10, 0.1}, {1002, -20, 0.1}};
  const CombinedDepth depth = average_depth(readings);
  EXPECT_DOUBLE_EQ(depth.depth_mm, 1001);
  EXPECT_NEAR(depth.sigma_mm, std::hypot(1, 2) / 2, 1e-12);
  EXPECT_DOUBLE_EQ(depth.quality, 1 / (1 + 0.25));
}

TEST(Triangulate, WeightsFollowWhatEachReadingKnowsOfDepth) {
  const DepthReading readings[] = {{1000, 10, 0.1}, {1003, 20, 0.1}};
  const auto depth = weighted_depth(readings, 0, 25);
  ASSERT_TRUE(depth);
  EXPECT_NEAR(depth->depth_mm, (4 * 1000 + 1003) / 5.0, 1e-9);
  EXPECT_NEAR(depth->sigma_mm, 1 / std::sqrt(1 + 0.25), 1e-12);
  const auto single = weighted_depth({readings, 1}, 0, 25);
  EXPECT_DOUBLE_EQ(single->quality, 0.5);
}

TEST(Triangulate, AGrossReadingIsDroppedAndTwoThatDisagreeGiveNothing) {
  const DepthReading three[] = {{1000, 10, 0.1}, {1100, 10, 0.1}, {1001, 10, 0.1}};
  const auto depth = weighted_depth(three, 0, 25);
  ASSERT_TRUE(depth);
  EXPECT_EQ(depth->used, 2);
  EXPECT_NEAR(depth->depth_mm, 1000.5, 1e-9);
  EXPECT_FALSE(weighted_depth({three, 2}, 0, 25));
}

}  // namespace
}  // namespace crumple
