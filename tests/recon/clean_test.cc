#include "recon/clean.h"

#include <algorithm>

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include "tests/recon/made_surfaces.h"

namespace crumple {
namespace {

const Eigen::Vector3d viewer(0, 0, 600);

CloudPoint point_at(double x, double y, double z) {
  CloudPoint point;
  point.position_mm = {x, y, z};
  point.sigma_mm = 0.03F;
  return point;
}

// The border of a square patch is an edge, one point wide.
std::size_t border(double half_mm, double pitch_mm) { return static_cast<std::size_t>(8 * (half_mm / pitch_mm)); }

TEST(Clean, FindsPlantedOutliersAndTheBorderAndNothingElse) {
  Cloud cloud = made_surface(flat, 20, 0.5, viewer, 0.03, 1);
  const std::size_t sound = cloud.points.size();
  // Far off, some together and some alone; and just off the surface, by ten sigma.
  for (const auto& [x, y, z] : {std::tuple{0.0, 0.0, -500.0}, {0.1, 0.0, -501.0}, {3.0, 4.0, 30.0}, {-9.0, 2.0, 5.0}}) {
    cloud.points.push_back(point_at(x, y, z));
  }
  for (const int i : {2000, 3003, 4100}) cloud.points[i].position_mm.z() += 0.3;
  const CleanedCloud clean = cleaned(cloud, viewer);
  EXPECT_EQ(clean.removed.isolated, 4U);
  EXPECT_EQ(clean.removed.off_surface, 3U);
  EXPECT_EQ(clean.removed.grazing, 0U);
  EXPECT_NEAR(static_cast<double>(clean.removed.edge), static_cast<double>(border(20, 0.5)), 6);
  EXPECT_EQ(clean.cloud.points.size(), sound + 4 - clean.removed.total());
  EXPECT_NEAR(clean.spacing_mm, 0.5, 0.02);
  for (const CloudPoint& point : clean.cloud.points) EXPECT_LT(std::abs(point.position_mm.z()), 0.2);
}

TEST(Clean, AStepHasAnEdgeOnBothSides) {
  const auto step = [](double x, double) { return x > 0.1 ? 6.0 : 0.0; };
  const CleanedCloud clean = cleaned(made_surface(step, 20, 0.5, viewer, 0.03, 2), viewer);
  EXPECT_EQ(clean.removed.isolated, 0U);
  EXPECT_NEAR(static_cast<double>(clean.removed.edge), static_cast<double>(border(20, 0.5) + 2 * 80), 12);
  for (const CloudPoint& point : clean.cloud.points) {
    EXPECT_GT(std::abs(point.position_mm.x() - 0.25), 0.3);
  }
}

TEST(Clean, GrazingSurfaceGoesAndItsLimitIsTheAngle) {
  // From 10 mm above the plane, 75 degrees are 37.3 mm away.
  const Eigen::Vector3d low(0, 0, 10);
  const CleanedCloud clean = cleaned(made_surface(flat, 60, 1, low, 0.0, 3), low);
  double farthest = 0;
  for (const CloudPoint& point : clean.cloud.points) farthest = std::max(farthest, point.position_mm.head<2>().norm());
  EXPECT_NEAR(farthest, 10 * std::tan(75 * M_PI / 180), 1);
  EXPECT_GT(clean.removed.grazing, 8000U);
}

TEST(Clean, ASpacingThatGrowsThreefoldIsNoNoise) {
  // As depth and inclination make it; the cloud's own mean and deviation would cut off the wide end.
  Cloud cloud;
  cloud.stations = {"a"};
  for (double x = 10; x < 60; x *= 1.02) {
    for (double y = -10; y <= 10; y += 0.02 * x) cloud.points.push_back(point_at(x, y, 0));
  }
  const CleanedCloud clean = cleaned(cloud, viewer);
  EXPECT_EQ(clean.removed.isolated, 0U);
  EXPECT_EQ(clean.removed.off_surface, 0U);
}

TEST(Clean, CurvedSurfaceStays) {
  const auto dome = [](double x, double y) { return std::sqrt(30 * 30 - x * x - y * y); };
  const CleanedCloud clean = cleaned(made_surface(dome, 10, 0.5, viewer, 0.002, 4), viewer);
  EXPECT_EQ(clean.removed.total(), clean.removed.edge);
}

TEST(Clean, FillsInNormalsThatWereMissing) {
  Cloud cloud = made_surface(flat, 5, 0.5, viewer, 0.001, 5);
  for (CloudPoint& point : cloud.points) point.normal.setZero();
  for (const CloudPoint& point : cleaned(cloud, viewer).cloud.points) EXPECT_GT(point.normal.z(), 0.99F);
}

// What a normal across the ray makes of a point's sigma along it is next to nothing.
TEST(Clean, ANormalThatStandsAcrossTheSurfaceIsReplaced) {
  Cloud cloud = made_surface(flat, 20, 0.5, viewer, 0.03, 1);
  const std::size_t planted = cloud.points.size() / 2 + 10;
  const Eigen::Vector3d place = cloud.points[planted].position_mm;
  for (CloudPoint& point : cloud.points) point.normal = {0, 0, 1};
  cloud.points[planted].normal = {1, 0, 0};
  for (const CloudPoint& point : cleaned(cloud, viewer).cloud.points) {
    EXPECT_GT(point.normal.z(), 0.98F) << (point.position_mm - place).norm();
  }
}

TEST(Clean, FewPointsAreAllIsolated) {
  Cloud cloud = made_surface(flat, 1, 1, viewer, 0.01, 6);
  const CleanedCloud clean = cleaned(cloud, viewer);
  EXPECT_EQ(clean.removed.isolated, 9U);
  EXPECT_TRUE(clean.cloud.points.empty());
  EXPECT_EQ(cleaned(Cloud{}, viewer).removed.total(), 0U);
}

TEST(Clean, SameAtAnyNumberOfThreads) {
  const Cloud cloud = made_surface(flat, 30, 0.5, viewer, 0.05, 7);
  const CleanedCloud one = cleaned(cloud, viewer, {.threads = 1}), three = cleaned(cloud, viewer, {.threads = 3});
  ASSERT_EQ(one.cloud.points.size(), three.cloud.points.size());
  for (std::size_t i = 0; i < one.cloud.points.size(); ++i) {
    EXPECT_EQ(one.cloud.points[i].position_mm, three.cloud.points[i].position_mm);
  }
  EXPECT_EQ(one.spacing_mm, three.spacing_mm);
}

RC_GTEST_PROP(Clean, IsAsGoodInAnyUnitOfLength, ()) {
  const double scale = *rc::gen::element(0.1, 1.0, 20.0);
  const Cloud cloud = made_surface(flat, 5, 0.5, viewer, 0.03, *rc::gen::inRange(0U, 1000U));
  Cloud scaled = cloud;
  for (CloudPoint& point : scaled.points) {
    point.position_mm *= scale;
    point.covariance_mm2 *= static_cast<float>(scale * scale);
  }
  const RemovedPoints here = cleaned(cloud, viewer).removed, there = cleaned(scaled, scale * viewer).removed;
  // Where a point lies at a limit, rounding decides.
  RC_ASSERT(std::abs(static_cast<int>(here.total()) - static_cast<int>(there.total())) <= 1);
}

}  // namespace
}  // namespace crumple
