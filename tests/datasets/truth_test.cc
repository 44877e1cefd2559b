#include "datasets/truth.h"

#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include "datasets/cloud_picture.h"
#include "datasets/image_io.h"
#include "tests/datasets/render_scenes.h"
#include "tests/temporary_folder.h"

namespace crumple {
namespace {

constexpr std::size_t kPanelStation = 4;  // the panel of small.yaml

// Points above the panel by `height_mm(x, y)` along its normal.
template <typename Height>
Cloud cloud_above(const Scene& scene, const Height& height_mm, float sigma_mm = 0) {
  const SceneStation& placed = scene.stations[kPanelStation];
  const Surface& surface = surface_at(scene, placed);
  Cloud cloud;
  cloud.stations = {placed.id};
  for (int y = -90; y <= 90; y += 3) {
    for (int x = -130; x <= 130; x += 3) {
      const SurfacePoint point = surface.at(x, y);
      CloudPoint added;
      added.position_mm = placed.probe_from_surface * (point.position_mm + height_mm(x, y) * point.normal);
      added.covariance_mm2 = sigma_mm * sigma_mm * Eigen::Matrix3f::Identity();
      added.sigma_mm = sigma_mm;
      cloud.points.push_back(added);
    }
  }
  return cloud;
}

DeviationSummary score(const Cloud& cloud, const Scene& scene) {
  const auto deviations = deviations_from_truth(cloud, scene, 2);
  EXPECT_TRUE(deviations);
  return summarise(cloud, *deviations);
}

TEST(Truth, DistanceIsSignedAndAlongTheNormal) {
  const Scene scene = scene_from_file("small.yaml");
  const DeviationSummary above = score(cloud_above(scene, [](int, int) { return 0.2; }), scene);
  EXPECT_NEAR(above.rms_mm, 0.2, 1e-9);
  EXPECT_NEAR(above.mean_mm, 0.2, 1e-9);
  EXPECT_NEAR(above.max_mm, 0.2, 1e-9);
  EXPECT_EQ(above.observed_over_predicted, 0);
  const DeviationSummary below = score(cloud_above(scene, [](int, int) { return -0.2; }), scene);
  EXPECT_NEAR(below.mean_mm, -0.2, 1e-9);
}

TEST(Truth, NoiseIsWhatWasPredicted) {
  const Scene scene = scene_from_file("small.yaml");
  std::mt19937_64 generator(5);
  std::normal_distribution<double> noise(0, 0.05);
  const Cloud cloud = cloud_above(
      scene, [&](int, int) { return noise(generator); }, 0.05F);
  const DeviationSummary summary = score(cloud, scene);
  EXPECT_NEAR(summary.robust_sigma_mm, 0.05, 0.003);
  EXPECT_NEAR(summary.observed_over_predicted, 1, 0.05);
  EXPECT_NEAR(summary.predicted_mm, 0.05, 1e-6);
}

TEST(Truth, OutliersAreTrimmedAndCounted) {
  const Scene scene = scene_from_file("small.yaml");
  std::mt19937_64 generator(6);
  std::normal_distribution<double> noise(0, 0.05);
  const Cloud cloud = cloud_above(scene, [&](int x, int y) { return x == -130 && y % 2 == 0 ? 4 : noise(generator); });
  const DeviationSummary summary = score(cloud, scene);
  EXPECT_NEAR(summary.max_mm, 4, 1e-6);
  EXPECT_GT(summary.rms_mm, 0.3);
  EXPECT_NEAR(summary.trimmed_rms_mm, 0.05, 0.003);
  EXPECT_NEAR(summary.trimmed_share, 31.0 / static_cast<double>(cloud.points.size()), 1e-9);
}

TEST(Truth, ARigidMotionIsTakenOutOfTheMovedFigure) {
  const Scene scene = scene_from_file("small.yaml");
  Cloud cloud = cloud_above(scene, [](int, int) { return 0.0; });
  Vector6d step;
  step << 3e-4, -2e-4, 1e-4, 0.02, -0.03, 0.05;
  for (CloudPoint& point : cloud.points) point.position_mm = retract(Pose{}, step) * point.position_mm;
  const DeviationSummary summary = score(cloud, scene);
  EXPECT_GT(summary.rms_mm, 0.03);
  EXPECT_LT(summary.moved_rms_mm, 0.02 * summary.rms_mm);
  EXPECT_LT(summary.moved_all_rms_mm, 0.02 * summary.rms_mm);
  const auto deviations = deviations_from_truth(cloud, scene, 2);
  ASSERT_TRUE(deviations);
  for (const Deviation& moved : moved_deviations(cloud, *deviations)) EXPECT_LT(std::abs(moved.distance_mm), 2e-3);
}

TEST(Truth, AnUnknownStationIsNamed) {
  const Scene scene = scene_from_file("small.yaml");
  Cloud cloud;
  cloud.stations = {"elsewhere"};
  const auto deviations = deviations_from_truth(cloud, scene, 1);
  ASSERT_FALSE(deviations);
  EXPECT_NE(deviations.error().message.find("elsewhere"), std::string::npos);
}

TEST(CloudPictureFile, IsTheSameTwiceAndShowsTheCloud) {
  const Scene scene = scene_from_file("small.yaml");
  const Cloud cloud = cloud_above(
      scene, [](int, int) { return 0.0; }, 0.1F);
  CloudPicture picture = picture_of_sigma(cloud, "A panel");
  picture.is_signed = true;  // all values alike lie at the bright red end of the colours
  const TemporaryFolder home;
  for (const char* const name : {"a.png", "b.png"}) {
    const auto drawn = write_cloud_picture(home / name, cloud, picture);
    ASSERT_TRUE(drawn) << drawn.error().message;
  }
  EXPECT_EQ(content_of(home / "a.png"), content_of(home / "b.png"));
  const auto image = read_image(home / "a.png");
  ASSERT_TRUE(image) << image.error().message;
  EXPECT_GT(image->at<std::uint16_t>(500, 700), 2 * image->at<std::uint16_t>(990, 1200));
  EXPECT_FALSE(write_cloud_picture(home / "c.png", Cloud{}, CloudPicture{}));
}

}  // namespace
}  // namespace crumple
