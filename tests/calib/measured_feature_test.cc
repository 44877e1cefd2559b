#include "calib/measured_feature.h"

#include <numbers>
#include <random>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "calib/feature_points.h"
#include "calib/measured_quantity.h"
#include "calib/sphere_fit.h"
#include "tests/calib/sphere_cap.h"
#include "tests/calib/tracked_probe.h"

namespace crumple {
namespace {

using testing::HasSubstr;

std::vector<std::size_t> all_of(std::size_t count, std::size_t from = 0) {
  std::vector<std::size_t> indices(count);
  for (std::size_t i = 0; i < count; ++i) indices[i] = from + i;
  return indices;
}

// A rig of which only the scale is uncertain: everything in mm grows with it.
Eigen::MatrixXd covariance_of_scale(TrackedProbe& probe, double relative) {
  probe.truth.rig.covariance.names.emplace_back("board.scale");
  Eigen::VectorXd by_scale = Eigen::VectorXd::Zero(probe.size() + 1);
  for (Eigen::Index i = 0; i < probe.size(); ++i) {
    const TrackedProbe::Row& row = probe.rows[static_cast<std::size_t>(i)];
    if (row.block.kind == BlockId::Kind::led)
      by_scale[i] = probe.truth.rig.leds[row.block.index].position_mm[row.index];
    if (row.block.kind == BlockId::Kind::mount && row.index >= 3) {
      by_scale[i] = probe.truth.rig.sensors[row.block.index].sensor_from_mount.translation[row.index - 3];
    }
  }
  by_scale[probe.size()] = 1;
  Eigen::MatrixXd covariance = relative * relative * by_scale * by_scale.transpose();
  covariance.diagonal().array() += 1e-18;
  return covariance;
}

TEST(FitSphere, FindsAnExactSphere) {
  const auto points = sphere_cap({}, {30, -20, 800}, 25, 1.0, 6);
  const auto sphere = fit_sphere(points);
  ASSERT_TRUE(sphere) << sphere.error().message;
  EXPECT_LT((sphere->centre - Eigen::Vector3d(30, -20, 800)).norm(), 1e-9);
  EXPECT_NEAR(sphere->radius, 25, 1e-9);
  EXPECT_NEAR(sphere->cap_rad, 1.0, 1e-6);
  EXPECT_FALSE(fit_sphere({{0, 0, 1}, {1, 0, 1}, {0, 1, 1}, {1, 1, 1}, {2, 1, 1}}));
  EXPECT_FALSE(fit_sphere({{0, 0, 1}, {1, 0, 1}, {0, 1, 2}}));
}

// Whatever moves the points moves the feature as by_rig says: central differences, points far off the surface included.
TEST(MeasuredFeature, MovesWithItsPoints) {
  TrackedProbe probe;
  Eigen::VectorXd sigma(probe.size());
  for (Eigen::Index i = 0; i < sigma.size(); ++i) sigma[i] = probe.scale_of(static_cast<std::size_t>(i));
  probe.truth.rig.covariance.matrix = Eigen::MatrixXd(sigma.cwiseAbs2().asDiagonal());
  const StationPoses poses = probe.poses(probe.truth.rig, probe.readings);
  const auto uncertainty = PointUncertainty::create(probe.truth.rig, poses).value();
  const Pose& pose = poses.stations[0].world_from_probe;
  Cloud cloud{"world", {"a", "b"}, {}};
  add_points(sphere_cap(pose, {30, -20, 800}, 40, 1.0, 4), 0, pose, 0.02, cloud);
  std::mt19937 random(3);
  std::normal_distribution<double> normal;
  for (CloudPoint& point : cloud.points) {
    for (double& x : point.position_mm) x += 0.5 * normal(random);
  }
  const auto indices = all_of(cloud.points.size());
  for (const auto measure : {measure_point, measure_plane, measure_sphere}) {
    const auto at = measure(KnownCloud(cloud, uncertainty), indices);
    ASSERT_TRUE(at) << at.error().message;
    for (const Eigen::Index k : {Eigen::Index{1}, Eigen::Index{9}, Eigen::Index{20}, uncertainty.variables() - 1}) {
      constexpr double kStep = 2;
      Eigen::VectorXd moved[2];
      for (const int side : {0, 1}) {
        Cloud shifted = cloud;
        for (std::size_t i = 0; i < indices.size(); ++i) {
          PointSensitivity sensitivity;
          const CloudShare share{0, 0, 1};
          ASSERT_TRUE(uncertainty.sensitivity(cloud.points[i].position_mm, {&share, 1}, sensitivity));
          shifted.points[i].position_mm += (side == 0 ? -kStep : kStep) * sensitivity.by_rig.col(k);
        }
        moved[side] = measure(KnownCloud(shifted, uncertainty), indices)->values;
      }
      const Eigen::VectorXd expected = (moved[1] - moved[0]) / (2 * kStep);
      EXPECT_LT((at->by_rig.col(k) - expected).norm(), 1e-3 * expected.norm() + 1e-9) << k;
    }
  }
}

// Noise of decoding, drawn: centre and radius of a cap scatter as predicted, and predictions of residuals hold.
TEST(MeasuredFeature, ASpheresCentreScattersAsPredicted) {
  TrackedProbe probe;
  probe.truth.rig.covariance.matrix = Eigen::MatrixXd::Identity(probe.size(), probe.size()) * 1e-18;
  const auto uncertainty =
      PointUncertainty::create(probe.truth.rig, probe.poses(probe.truth.rig, probe.readings)).value();
  const Pose& pose = uncertainty.poses().stations[0].world_from_probe;
  constexpr double kSigma_mm = 0.03;
  Cloud exact{"world", {"a", "b"}, {}};
  add_points(sphere_cap(pose, {30, -20, 800}, 25, 1.0, 8), 0, pose, kSigma_mm, exact);
  const auto indices = all_of(exact.points.size());
  const auto predicted = measure_sphere(KnownCloud(exact, uncertainty), indices).value();
  EXPECT_EQ(predicted.inflation, 1);
  std::mt19937 random(5);
  std::normal_distribution<double> normal;
  constexpr int kDraws = 200;
  Eigen::Vector4d squares = Eigen::Vector4d::Zero();
  double residual_squares = 0;
  int inflated = 0;
  for (int draw = 0; draw < kDraws; ++draw) {
    Cloud cloud = exact;
    std::vector<Eigen::Vector3d> positions;
    for (CloudPoint& point : cloud.points) {
      point.position_mm += kSigma_mm * normal(random) * (point.position_mm - pose.translation).normalized();
      positions.push_back(point.position_mm);
    }
    const Sphere sphere = fit_sphere(positions).value();
    Eigen::Vector4d error;
    error << sphere.centre, sphere.radius;
    squares += (error - predicted.values).cwiseAbs2() / kDraws;
    for (const Eigen::Vector3d& x : positions) residual_squares += sphere.distance(x) * sphere.distance(x) / kDraws;
    if (measure_sphere(KnownCloud(cloud, uncertainty), indices)->inflation > 1) ++inflated;
  }
  for (int i = 0; i < 4; ++i) EXPECT_NEAR(squares[i] / predicted.decoding(i, i), 1, 0.3) << i;
  double expected = 0;
  for (const double s : predicted.residual_sigmas_mm) expected += s * s;
  EXPECT_NEAR(residual_squares / expected, 1, 0.03);
  EXPECT_NEAR(inflated, 0.1 * kDraws, 3 * std::sqrt(0.1 * 0.9 * kDraws));
}

// An oval where a sphere should be: residuals are no noise, so the decoding part grows.
TEST(MeasuredFeature, WhatIsNotRoundRaisesTheDecodingPart) {
  TrackedProbe probe;
  probe.truth.rig.covariance.matrix = Eigen::MatrixXd::Identity(probe.size(), probe.size()) * 1e-18;
  const auto uncertainty =
      PointUncertainty::create(probe.truth.rig, probe.poses(probe.truth.rig, probe.readings)).value();
  const Pose& pose = uncertainty.poses().stations[0].world_from_probe;
  auto positions = sphere_cap(pose, {30, -20, 800}, 25, 1.0, 8);
  for (Eigen::Vector3d& x : positions) x.x() = pose.translation.x() + 1.01 * (x.x() - pose.translation.x());
  Cloud cloud{"world", {"a", "b"}, {}};
  add_points(positions, 0, pose, 0.01, cloud);
  EXPECT_GT(measure_sphere(KnownCloud(cloud, uncertainty), all_of(positions.size()))->inflation, 10);
}

TEST(MeasuredQuantity, AScaleErrorIsInEveryLengthAndInNoAngle) {
  TrackedProbe probe;
  constexpr double kRelative = 5e-5;
  probe.truth.rig.covariance.matrix = covariance_of_scale(probe, kRelative);
  const auto known = PointUncertainty::create(probe.truth.rig, probe.poses(probe.truth.rig, probe.readings)).value();
  EXPECT_EQ(known.scale_variables(), 1);
  const Pose &first = known.poses().stations[0].world_from_probe, &second = known.poses().stations[1].world_from_probe;
  Cloud cloud{"world", {"a", "b"}, {}};
  add_points({first * Eigen::Vector3d(-60, -40, 780), first * Eigen::Vector3d(80, 30, 820)}, 0, first, 0.02, cloud);
  add_points({second * Eigen::Vector3d(20, -50, 800)}, 1, second, 0.02, cloud);
  const KnownCloud kept(cloud, known);
  std::vector<MeasuredFeature> points;
  for (std::size_t i = 0; i < 3; ++i) points.push_back(measure_point(kept, {i}).value());
  for (const auto& [a, b] : {std::pair{0, 1}, std::pair{0, 2}, std::pair{1, 2}}) {
    const auto& [from, to] = std::tie(points[static_cast<std::size_t>(a)], points[static_cast<std::size_t>(b)]);
    const MeasuredQuantity length = distance(known, from, to).value();
    EXPECT_NEAR(length.value, (from.position() - to.position()).norm(), 1e-12);
    EXPECT_NEAR(std::sqrt(length.budget.scale), kRelative * length.value, 1e-3 * kRelative * length.value);
    EXPECT_LT(length.budget.calibration, 1e-6);
    EXPECT_GT(length.budget.decoding, 0);
  }
  const MeasuredQuantity turned = angle(known, points[0], points[1], points[2]).value();
  EXPECT_LT(std::sqrt(turned.budget.scale), 1e-3 * kRelative);
  EXPECT_FALSE(distance(known, points[0], points[0]));
}

TEST(MeasuredQuantity, PlanesMeetAtTheirAngle) {
  TrackedProbe probe;
  probe.truth.rig.covariance.matrix = Eigen::MatrixXd::Identity(probe.size(), probe.size()) * 1e-18;
  const auto known = PointUncertainty::create(probe.truth.rig, probe.poses(probe.truth.rig, probe.readings)).value();
  const Pose& pose = known.poses().stations[0].world_from_probe;
  std::vector<Eigen::Vector3d> flat, tilted;
  for (int x = -5; x <= 5; ++x) {
    for (int y = -5; y <= 5; ++y) {
      flat.emplace_back(pose * Eigen::Vector3d(10 * x, 8 * y, 800));
      tilted.emplace_back(pose * Eigen::Vector3d(10 * x, 8 * y, 760 + 10 * x * std::tan(0.3)));
    }
  }
  constexpr double kSigma_mm = 0.02;
  Cloud cloud{"world", {"a", "b"}, {}};
  add_points(flat, 0, pose, kSigma_mm, cloud);
  add_points(tilted, 0, pose, kSigma_mm, cloud);
  const KnownCloud kept(cloud, known);
  const auto a = measure_plane(kept, all_of(flat.size())).value();
  const auto b = measure_plane(kept, all_of(tilted.size(), flat.size())).value();
  const MeasuredQuantity between = angle(known, a, b).value();
  EXPECT_NEAR(between.value, 0.3, 1e-12);
  // Slope of a line through heights of independent noise: sigma^2 / sum x^2, here of two planes, one seen aslant.
  double sum = 0;
  for (int x = -5; x <= 5; ++x) sum += 11 * 100 * x * x;
  const double flat_only = kSigma_mm * kSigma_mm / sum;
  EXPECT_GT(between.budget.decoding, 1.5 * flat_only);
  EXPECT_LT(between.budget.decoding, 2.1 * flat_only);
  const auto point = measure_point(kept, {0}).value();
  EXPECT_NEAR(distance_from_plane(known, point, b).value, -(40 + 50 * std::tan(0.3)) * std::cos(0.3), 1e-9);
  EXPECT_THAT(angle(known, a, a).error().message, HasSubstr("parallel"));
}

// A plate twice as long as wide, its decoding drawn: the normal's tip scatters along both axes as predicted, and most
// about the long one.
TEST(MeasuredQuantity, ANormalScattersAsPredicted) {
  TrackedProbe probe;
  probe.truth.rig.covariance.matrix = Eigen::MatrixXd::Identity(probe.size(), probe.size()) * 1e-18;
  const auto known = PointUncertainty::create(probe.truth.rig, probe.poses(probe.truth.rig, probe.readings)).value();
  const Pose& pose = known.poses().stations[0].world_from_probe;
  std::vector<Eigen::Vector3d> plate;
  for (int x = -5; x <= 5; ++x) {
    for (int y = -5; y <= 5; ++y) plate.emplace_back(pose * Eigen::Vector3d(12 * x, 6 * y, 800));
  }
  constexpr double kSigma_mm = 3;  // beside which the station's part is nothing
  Cloud exact{"world", {"a", "b"}, {}};
  add_points(plate, 0, pose, kSigma_mm, exact);
  const auto indices = all_of(plate.size());
  const MeasuredFeature plane = measure_plane(KnownCloud(exact, known), indices).value();
  const auto tilts = normal_tilts(known, plane);
  EXPECT_GT(std::abs(tilts[0].about.dot(pose.rotation * Eigen::Vector3d::UnitX())), 0.999);
  EXPECT_NEAR(tilts[0].about.dot(tilts[1].about), 0, 1e-12);
  EXPECT_NEAR(tilts[0].about.dot(plane.normal()), 0, 1e-12);
  EXPECT_EQ(tilts[0].tilt.value, 0);
  EXPECT_NEAR(std::sqrt(tilts[0].tilt.budget.decoding / tilts[1].tilt.budget.decoding), 2, 0.05);
  std::mt19937 random(5);
  std::normal_distribution<double> normal;
  constexpr int kDraws = 200;
  double squares[2] = {0, 0}, product = 0;
  for (int draw = 0; draw < kDraws; ++draw) {
    Cloud cloud = exact;
    for (CloudPoint& point : cloud.points) {
      point.position_mm += kSigma_mm * normal(random) * (point.position_mm - pose.translation).normalized();
    }
    const Eigen::Vector3d found = measure_plane(KnownCloud(cloud, known), indices)->normal();
    const Eigen::Vector3d turn = plane.normal().cross(found);
    double by[2];
    for (const std::size_t axis : {0U, 1U}) {
      by[axis] = turn.dot(tilts[axis].about) / std::sqrt(tilts[axis].tilt.budget.decoding);
      squares[axis] += by[axis] * by[axis] / kDraws;
    }
    product += by[0] * by[1] / kDraws;
  }
  EXPECT_NEAR(squares[0], 1, 0.3);
  EXPECT_NEAR(squares[1], 1, 0.3);
  EXPECT_NEAR(product, 0, 0.25);
}

// From every source what an angle to a plane that is exact has, turned about the same axis.
TEST(MeasuredQuantity, ATiltHasTheBudgetOfAnAngleAboutItsAxis) {
  TrackedProbe probe;
  constexpr double kRelative = 5e-5;
  probe.truth.rig.covariance.matrix = covariance_of_scale(probe, kRelative);
  for (Eigen::Index i = 0; i < probe.size(); ++i) {
    probe.truth.rig.covariance.matrix(i, i) += std::pow(probe.scale_of(static_cast<std::size_t>(i)), 2);
  }
  const auto known = PointUncertainty::create(probe.truth.rig, probe.poses(probe.truth.rig, probe.readings)).value();
  const Pose& pose = known.poses().stations[0].world_from_probe;
  std::vector<Eigen::Vector3d> plate;
  for (int x = -3; x <= 3; ++x) {
    for (int y = -3; y <= 3; ++y) plate.emplace_back(pose * Eigen::Vector3d(9 * x, 7 * y, 800 + 5 * x));
  }
  Cloud cloud{"world", {"a", "b"}, {}};
  add_points(plate, 0, pose, 0.02, cloud);
  const MeasuredFeature plane = measure_plane(KnownCloud(cloud, known), all_of(plate.size())).value();
  MeasuredFeature exact = plane;
  exact.by_rig.setZero();
  exact.by_pose.setZero();
  exact.decoding.setZero();
  double total = 0;
  for (const NormalTilt& tilt : normal_tilts(known, plane)) {
    exact.values.tail<3>() = Eigen::AngleAxisd(0.4, tilt.about) * plane.normal();
    const Budget expected = angle(known, plane, exact)->budget;
    const Budget& found = tilt.tilt.budget;
    EXPECT_NEAR(found.calibration / expected.calibration, 1, 1e-9);
    EXPECT_NEAR(found.station / expected.station, 1, 1e-9);
    EXPECT_NEAR(found.decoding / expected.decoding, 1, 1e-9);
    EXPECT_NEAR(found.scale, expected.scale, 1e-9 * found.sum());
    EXPECT_GT(found.station, 0);
    total += found.sum();
  }
  const Eigen::MatrixXd all = plane.by_rig * plane.by_rig.transpose() +
                              plane.by_pose * known.poses().covariance * plane.by_pose.transpose() + plane.decoding;
  EXPECT_NEAR(total / all.diagonal().tail<3>().sum(), 1, 1e-6);
}

TEST(FeaturePoints, ANarrowCapAndAnEmptyPlaceAreRefused) {
  Cloud cloud;
  const Eigen::Vector3d centre(0, 0, 800);
  add_points(sphere_cap({}, centre, 60, 0.3, 10), 0, {}, 0.02, cloud);
  const auto narrow = points_on_sphere(cloud, centre + Eigen::Vector3d(1, 1, 2), 60);
  ASSERT_FALSE(narrow);
  EXPECT_THAT(narrow.error().message, HasSubstr("only a cap of 17 degrees"));
  EXPECT_THAT(points_on_sphere(cloud, {0, 0, 400}, 60).error().message, HasSubstr("only 0 points"));
  EXPECT_TRUE(points_within(cloud, {0, 0, 400}, 60).empty());
  cloud.points.clear();
  add_points(sphere_cap({}, centre, 60, 0.9, 10), 0, {}, 0.02, cloud);
  const std::size_t on_sphere = cloud.points.size();
  add_points({{0, 0, 860}, {90, 0, 800}, {30, 30, 700}}, 0, {}, 0.02, cloud);
  EXPECT_EQ(points_on_sphere(cloud, centre + Eigen::Vector3d(4, -3, 5), 60)->size(), on_sphere + 1);
  EXPECT_THAT(points_on_sphere(cloud, centre, 75).error().message, HasSubstr("radius of"));
}

}  // namespace
}  // namespace crumple
