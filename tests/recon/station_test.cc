#include "recon/station.h"

#include <cmath>

#include <gtest/gtest.h>
#include <opencv2/core.hpp>
#include <opencv2/core/utility.hpp>

#include "tests/recon/synthetic_stripes.h"

namespace crumple {
namespace {

constexpr ImageSize kCamera{160, 120};
constexpr ImageSize kProjector{128, 96};

// The projector stands above the camera, so columns run along the epipolar lines. Both lenses are distorted.
StationGeometry geometry() {
  const Lens camera = *Lens::create("LENSMODEL_OPENCV5", kCamera, {400, 400, 79, 60, -0.08, 0.05, 0.001, 0, 0});
  const Lens projector = *Lens::create("LENSMODEL_OPENCV5", kProjector, {210, 210, 62, 80, 0.05, -0.02, 0, 0.001, 0});
  const Pose probe_from_cam{rotation_from_vector({0.3, -0.2, 0.1}), {10, 20, 30}};
  const Pose proj_from_cam{rotation_from_vector({-0.2, 0, 0}), {0, -200, -20}};
  return {camera, projector, probe_from_cam.inverse(), proj_from_cam * probe_from_cam.inverse()};
}

// The plane n . X = 1000 mm, in the camera's frame.
const Eigen::Vector3d kNormal = Eigen::Vector3d(0.1, 0.15, 1).normalized();

double true_depth(const StationGeometry& g, const Eigen::Vector2d& pixel) {
  return 1000 / kNormal.dot(*g.camera.ray(pixel));
}

StripeImages images(const StationGeometry& g, const std::vector<StripeOrientation>& orientations, double noise) {
  StripeScene scene;
  scene.projector = kProjector;
  scene.camera = {kCamera.width_px, kCamera.height_px};
  scene.noise = noise;
  scene.projector_from_camera = [&](const Eigen::Vector2d& pixel) {
    return *g.projector.project(g.proj_from_cam * (true_depth(g, pixel) * *g.camera.ray(pixel)));
  };
  return render_stripes(scene, orientations);
}

double plane_rms(const StationGeometry& g, const Cloud& cloud) {
  double squares = 0;
  for (const CloudPoint& p : cloud.points) {
    squares += std::pow(kNormal.dot(g.probe_from_cam.inverse() * p.position_mm) - 1000, 2);
  }
  return std::sqrt(squares / static_cast<double>(cloud.points.size()));
}

const std::vector<StripeOrientation> kColumnsAndRows = {{.bits = 7}, {.angle_rad = M_PI / 2, .bits = 7}};

class StationTest : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    geometry_ = new StationGeometry(geometry());
    images_ = new StripeImages(images(*geometry_, kColumnsAndRows, 1));
  }
  static void TearDownTestSuite() {
    delete images_;
    delete geometry_;
  }
  static StationCloud reconstruct(Estimator estimator) {
    auto station = reconstruct_station(*geometry_, *images_, {.estimator = estimator, .name = "A7"});
    EXPECT_TRUE(station) << station.error().message;
    return *std::move(station);
  }

  static StationGeometry* geometry_;
  static StripeImages* images_;
};
StationGeometry* StationTest::geometry_ = nullptr;
StripeImages* StationTest::images_ = nullptr;

TEST_F(StationTest, PaperLeavesOutColumnsAndNamesThem) {
  const StationCloud station = reconstruct(Estimator::paper);
  ASSERT_EQ(station.orientations.size(), 2U);
  EXPECT_FALSE(station.orientations[0].used);
  EXPECT_NE(station.orientations[0].reason.find("orientation 0 deg"), std::string::npos);
  EXPECT_TRUE(station.orientations[1].used);
  EXPECT_EQ(station.cloud.stations, std::vector<std::string>{"A7"});
  EXPECT_GT(station.decoded_fraction, 0.95);
  // Uniform within a stripe.
  EXPECT_NEAR(plane_rms(*geometry_, station.cloud) / station.median_sigma_mm, 1, 0.1);
}

TEST_F(StationTest, WeightedIsManyTimesBetterAndKnowsItsSigma) {
  const StationCloud station = reconstruct(Estimator::weighted);
  const double paper_rms = plane_rms(*geometry_, reconstruct(Estimator::paper).cloud);
  const double rms = plane_rms(*geometry_, station.cloud);
  EXPECT_LT(rms, 0.15 * paper_rms);
  double standardised = 0;
  for (const CloudPoint& p : station.cloud.points) {
    const double away = kNormal.dot(geometry_->probe_from_cam.inverse() * p.position_mm) - 1000;
    standardised += std::pow(away / p.sigma_mm, 2);
  }
  EXPECT_NEAR(std::sqrt(standardised / static_cast<double>(station.cloud.points.size())), 1, 0.3);
  EXPECT_GT(station.decoded_fraction, 0.95);
  const double depth = station.depth_mm.at<double>(60, 80);
  EXPECT_NEAR(depth, true_depth(*geometry_, {80, 60}), 6 * station.sigma_mm.at<float>(60, 80));
}

TEST_F(StationTest, NormalsFaceTheCamera) {
  const StationCloud station = reconstruct(Estimator::weighted);
  const Eigen::Vector3d expected = geometry_->probe_from_cam.rotation * -kNormal;
  double mean = 0;
  for (const CloudPoint& p : station.cloud.points) mean += p.normal.cast<double>().dot(expected);
  EXPECT_GT(mean / static_cast<double>(station.cloud.points.size()), 0.95);
}

TEST_F(StationTest, EdgesLieOnThePlane) {
  const StationCloud station = reconstruct(Estimator::edges);
  EXPECT_GT(station.cloud.points.size(), 3000U);
  EXPECT_LT(plane_rms(*geometry_, station.cloud), 0.25 * plane_rms(*geometry_, reconstruct(Estimator::paper).cloud));
}

TEST_F(StationTest, SameBitsOnOneThreadAndTwo) {
  const int threads = cv::getNumThreads();
  cv::setNumThreads(1);
  const StationCloud one = reconstruct(Estimator::weighted);
  cv::setNumThreads(2);
  const StationCloud two = reconstruct(Estimator::weighted);
  cv::setNumThreads(threads);
  ASSERT_EQ(one.cloud.points.size(), two.cloud.points.size());
  for (std::size_t i = 0; i < one.cloud.points.size(); ++i) {
    ASSERT_EQ(one.cloud.points[i].position_mm, two.cloud.points[i].position_mm);
    ASSERT_EQ(one.cloud.points[i].sigma_mm, two.cloud.points[i].sigma_mm);
  }
}

TEST_F(StationTest, MismatchesAreSentences) {
  StripeImages other = *images_;
  other.projector = {127, 96};
  const auto wrong_projector = reconstruct_station(*geometry_, other, {.name = "A7"});
  ASSERT_FALSE(wrong_projector);
  EXPECT_NE(wrong_projector.error().message.find("A7"), std::string::npos);

  other = *images_;
  other.white = other.black.clone();
  const auto dark = reconstruct_station(*geometry_, other, {.name = "A7"});
  ASSERT_FALSE(dark);
  EXPECT_NE(dark.error().message.find("0 of"), std::string::npos);
}

}  // namespace
}  // namespace crumple
