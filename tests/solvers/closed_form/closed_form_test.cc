#include <random>

#include <gtest/gtest.h>

#include "solvers/closed_form/homography.h"
#include "solvers/closed_form/resection.h"
#include "solvers/closed_form/zhang.h"
#include "tests/solvers/synthetic.h"

namespace crumple {
namespace {

struct PinholeViews {
  Synthetic made;
  std::vector<Eigen::Matrix3d> homographies;
};

PinholeViews views(SyntheticOptions options) {
  options.model = "LENSMODEL_PINHOLE";
  PinholeViews result{make_synthetic(options), {}};
  for (const CornerView& view : result.made.observations.corners) {
    Points2d on_board;
    for (const int corner : view.corners) on_board.push_back(result.made.truth.boards[0].point(corner).head<2>());
    result.homographies.push_back(homography(on_board, view.pixels).value());
  }
  return result;
}

TEST(Homography, RecoversTheMap) {
  const Eigen::Matrix3d truth = (Eigen::Matrix3d() << 1.2, 0.1, 300, -0.2, 0.9, 150, 1e-4, -2e-4, 1).finished();
  Points2d a, b;
  for (const Eigen::Vector2d& p : Points2d{{0, 0}, {400, 10}, {390, 300}, {-5, 310}, {123, 45}}) {
    a.push_back(p);
    b.push_back(apply_homography(truth, p));
  }
  EXPECT_LT((homography(a, b).value() - truth.normalized()).norm(), 1e-12);
}

TEST(Homography, RefusesPointsOnALine) {
  Points2d line;
  for (int i = 0; i < 10; ++i) line.emplace_back(i * 10.0, i * 7.0);
  EXPECT_FALSE(homography(line, line));
  EXPECT_FALSE(homography({{0, 0}, {1, 0}, {0, 1}}, {{0, 0}, {1, 0}, {0, 1}}));
}

TEST(Zhang, RecoversIntrinsicsAndPoses) {
  const PinholeViews v = views({});
  const PinholeIntrinsics k = zhang_intrinsics(v.homographies).value();
  const std::vector<double>& truth = v.made.truth.rig.sensors[0].lens.parameters();
  EXPECT_NEAR(k.focal_x_px, truth[0], 1e-6);
  EXPECT_NEAR(k.focal_y_px, truth[1], 1e-6);
  EXPECT_NEAR(k.principal_point_px.x(), truth[2], 1e-6);
  EXPECT_NEAR(k.principal_point_px.y(), truth[3], 1e-6);
  for (std::size_t i = 0; i < v.homographies.size(); ++i) {
    const Vector6d step = local_step(plane_pose(v.homographies[i], k.matrix()), v.made.truth.world_from_board[i]);
    EXPECT_LT(step.norm(), 1e-6);
  }
}

TEST(IntrinsicsAbout, RecoversAFocalLength) {
  const Eigen::Vector2d centre(515, 380);
  Eigen::Matrix3d k;
  k << 1400, 0, centre.x(), 0, 1400, centre.y(), 0, 0, 1;
  std::vector<Eigen::Matrix3d> homographies;
  for (const Vector6d& tilt : {(Vector6d() << 0.5, 0.1, 0, -100, -80, 700).finished(),
                               (Vector6d() << -0.1, 0.6, 0.3, -90, -110, 800).finished()}) {
    const Pose pose = retract({}, tilt);
    Eigen::Matrix3d plane;
    plane << pose.rotation.toRotationMatrix().leftCols<2>(), pose.translation;
    homographies.push_back(-3 * k * plane);  // of any scale and sign
  }
  const PinholeIntrinsics found = intrinsics_about(centre, homographies).value();
  EXPECT_NEAR(found.focal_x_px, 1400, 1e-8);
  EXPECT_EQ(found.focal_y_px, found.focal_x_px);
  EXPECT_EQ(found.principal_point_px, centre);
  EXPECT_FALSE(planes_are_parallel(homographies));
  // A plane straight on says nothing of it, and a projection that no pinhole makes is refused.
  EXPECT_FALSE(intrinsics_about(centre, {k, k}));
  Eigen::Matrix3d stretched = homographies[0];
  stretched.col(0) *= 30;
  EXPECT_FALSE(intrinsics_about(centre, {stretched}));
}

TEST(Zhang, NoiseLeavesAUsableStart) {
  const PinholeIntrinsics k = zhang_intrinsics(views({.corner_sigma_px = 0.3}).homographies).value();
  EXPECT_NEAR(k.focal_x_px, 1400, 70);
  EXPECT_NEAR(k.principal_point_px.x(), 515, 60);
}

TEST(Zhang, RefusesParallelPlacements) {
  PinholeViews v = views({.placements = 1});
  const Eigen::Matrix3d k = PinholeIntrinsics{1400, 1404, {515, 380}}.matrix();
  std::vector<Eigen::Matrix3d> parallel;
  for (int i = 0; i < 5; ++i) {
    Eigen::Matrix3d plane = Eigen::Matrix3d::Identity();
    plane.col(2) << 20.0 * i - 100, 15.0 * i - 80, 700 + 50 * i;
    parallel.push_back(k * plane);
  }
  const auto answer = zhang_intrinsics(parallel);
  ASSERT_FALSE(answer);
  EXPECT_NE(answer.error().message.find("parallel"), std::string::npos);
}

// Shifts, turns about the common normal, noise and a lens that bends: nothing of which is a tilt.
std::vector<Eigen::Matrix3d> homographies_at(const std::vector<Eigen::Vector3d>& tilts, double sigma_px,
                                             unsigned seed) {
  std::mt19937_64 generator(seed);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform(-1, 1);
  std::vector<Eigen::Matrix3d> homographies;
  for (const Eigen::Vector3d& tilt : tilts) {
    const double z = 800 * (1 + 0.2 * uniform(generator));
    Pose pose{rotation_from_vector(tilt) * rotation_from_vector({0, 0, 0.5 * uniform(generator)}),
              {60 * uniform(generator), 50 * uniform(generator), z}};
    Points2d plane, pixels;
    for (int i = 0; i < 54; ++i) {
      plane.emplace_back(40 * (i % 9 - 4), 40 * (i / 9 - 2.5));
      const Eigen::Vector2d x = (pose * Eigen::Vector3d(plane.back().x(), plane.back().y(), 0)).hnormalized();
      const Eigen::Vector2d noise(sigma_px * normal(generator), sigma_px * normal(generator));
      pixels.emplace_back(1400 * (1 - 0.1 * x.squaredNorm()) * x + Eigen::Vector2d(515, 380) + noise);
    }
    homographies.push_back(homography(plane, pixels).value());
  }
  return homographies;
}

TEST(Zhang, RefusesParallelPlacementsUnderNoise) {
  for (const double tilt : {0.0, 0.2, 0.5}) {
    for (unsigned seed = 1; seed <= 20; ++seed) {
      const std::vector<Eigen::Vector3d> tilts(3 + seed % 5, Eigen::Vector3d(tilt, 0, 0));
      const auto answer = zhang_intrinsics(homographies_at(tilts, 0.1, seed));
      ASSERT_FALSE(answer) << "tilt " << tilt << ", seed " << seed;
      EXPECT_NE(answer.error().message.find("parallel"), std::string::npos);
    }
  }
}

TEST(Zhang, AcceptsSmallTiltsUnderNoise) {
  for (unsigned seed = 1; seed <= 20; ++seed) {
    std::vector<Eigen::Vector3d> tilts;
    for (unsigned i = 0; i < 3 + seed % 5; ++i) {
      tilts.emplace_back(0.2 * std::cos(2.4 * i), 0.2 * std::sin(2.4 * i), 0);
    }
    const auto answer = zhang_intrinsics(homographies_at(tilts, 0.1, seed));
    ASSERT_TRUE(answer) << answer.error().message;
    EXPECT_NEAR(answer->focal_x_px, 1400, 140);
  }
}

TEST(Resection, RecoversAProjectorWithAnOffsetLens) {
  const PinholeViews v = views({.placements = 3});
  std::vector<Eigen::Vector3d> points;
  Points2d pixels;
  const Sensor& projector = v.made.truth.rig.sensors[1];
  for (const Pose& probe_from_board : v.made.truth.world_from_board) {
    for (int i = 0; i < v.made.truth.boards[0].point_count(); ++i) {
      points.push_back(probe_from_board * v.made.truth.boards[0].point(i));
      pixels.push_back(*projector.lens.project(projector.sensor_from_mount * points.back()));
    }
  }
  const Resection found = resect(points, pixels).value();
  EXPECT_NEAR(found.intrinsics.focal_x_px, projector.lens.parameters()[0], 1e-4);
  EXPECT_NEAR(found.intrinsics.principal_point_px.y(), 850, 1e-4);
  EXPECT_LT(local_step(found.sensor_from_points, projector.sensor_from_mount).norm(), 1e-4);
}

TEST(Resection, RefusesPointsOnAPlane) {
  std::vector<Eigen::Vector3d> points;
  Points2d pixels;
  for (int i = 0; i < 20; ++i) {
    points.emplace_back(i % 5 * 10, i / 5 * 10, 500 + i % 5 * 3);
    pixels.emplace_back(points.back().hnormalized() * 1000);
  }
  EXPECT_FALSE(resect(points, pixels));
}

}  // namespace
}  // namespace crumple
