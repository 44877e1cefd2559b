// Patches of a surface from stripe coordinates, and which of two stations' face each other.
#include "recon/overlap.h"

#include <cmath>

#include <gtest/gtest.h>

#include "recon/triangulate.h"

namespace crumple {
namespace {

StationGeometry two_sensors() {
  const Lens camera = *Lens::undistorted("LENSMODEL_PINHOLE", {320, 240}, 1400, 1400, Eigen::Vector2d(159, 121));
  const Lens projector = *Lens::undistorted("LENSMODEL_PINHOLE", {400, 300}, 1400, 1400, Eigen::Vector2d(200, 150));
  const Pose proj_from_cam{rotation_from_vector({0, 0.25, 0}), {-180, 4, 10}};
  const Pose cam_from_probe{rotation_from_vector({0.1, -0.2, 0.3}), {20, -30, 40}};
  return {camera, projector, cam_from_probe, proj_from_cam * cam_from_probe};
}

// The plane normal . x = distance in the camera's frame, to the left of a column alone; beyond it a step of 5 mm.
StripeCoordinates coordinates_of(const StationGeometry& g, const Eigen::Vector3d& normal, double distance_mm,
                                 int step_x) {
  StripeCoordinates result;
  result.coordinate_px = cv::Mat(240, 320, CV_64F, cv::Scalar(0));
  result.sigma_px = cv::Mat(240, 320, CV_32F, cv::Scalar(0.01));
  const StripeTriangulator triangulator(g.projector, g.proj_from_cam, Eigen::Vector2d::UnitX());
  for (int y = 0; y < 240; ++y) {
    for (int x = 0; x < 320; ++x) {
      const Eigen::Vector3d ray = g.rays.at(x, y);
      const double depth = (distance_mm + (x >= step_x ? 5 : 0)) / normal.dot(ray);
      result.coordinate_px.at<double>(y, x) = *triangulator.coordinate_px(ray, depth);
    }
  }
  return result;
}

TEST(SurfacePatches, LieOnThePlaneWithItsNormalAndNotOnAStep) {
  const StationGeometry g = two_sensors();
  const Eigen::Vector3d normal = Eigen::Vector3d(0.2, -0.1, 1).normalized();
  const auto patches = surface_patches(g, {.angle_rad = 0, .stripe_width_px = 1}, coordinates_of(g, normal, 700, 160));
  EXPECT_GT(patches.size(), 900U);
  for (const SurfacePatch& patch : patches) {
    EXPECT_TRUE(patch.camera_pixel.x() + 5 < 160 || patch.camera_pixel.x() - 5 >= 160) << patch.camera_pixel.x();
    const Eigen::Vector3d in_camera = g.probe_from_cam.inverse() * patch.position_mm;
    const double expected = patch.camera_pixel.x() < 160 ? 700 : 705;
    EXPECT_NEAR(normal.dot(in_camera), expected, 0.01);
    EXPECT_NEAR(patch.normal.dot(g.probe_from_cam.rotation * -normal), 1, 1e-6);
  }
}

// A grid of patches on z = 700, 5 mm apart, from column `first` on.
std::vector<SurfacePatch> grid(int first, int columns) {
  std::vector<SurfacePatch> patches;
  for (int y = 0; y < 20; ++y) {
    for (int x = first; x < first + columns; ++x) {
      patches.push_back({Eigen::Vector2d(x, y), 0, Eigen::Vector3d(5 * x, 5 * y, 700), -Eigen::Vector3d::UnitZ()});
    }
  }
  return patches;
}

TEST(PatchOverlap, PairsWhatBothStationsSaw) {
  const auto here = grid(0, 30), there = grid(20, 30);
  const auto pairs = overlap(here, there, {Eigen::Quaterniond::Identity(), Eigen::Vector3d(1, -1, 2)});
  EXPECT_EQ(pairs.size(), 200U);  // ten columns
  for (const PatchPair& pair : pairs) {
    EXPECT_EQ(here[pair.here].position_mm, there[pair.there].position_mm);
  }
  EXPECT_TRUE(overlap(here, grid(31, 10), {}).empty());
  EXPECT_TRUE(overlap(here, there, {Eigen::Quaterniond::Identity(), Eigen::Vector3d(0, 0, 20)}).empty());
  auto turned = there;
  for (SurfacePatch& patch : turned) patch.normal = Eigen::Vector3d(0.5, 0, -1).normalized();
  EXPECT_TRUE(overlap(here, turned, {}).empty());
}

TEST(PatchOverlap, OfManyPairsSomeAreTakenEvenly) {
  const auto here = grid(0, 30), there = grid(0, 30);
  const auto pairs = overlap(here, there, {}, {.most = 60});
  ASSERT_EQ(pairs.size(), 60U);
  for (std::size_t i = 1; i < pairs.size(); ++i) EXPECT_EQ(pairs[i].here - pairs[i - 1].here, 10U);
}

}  // namespace
}  // namespace crumple
