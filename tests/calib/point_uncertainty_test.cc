#include "calib/point_uncertainty.h"

#include <numbers>
#include <random>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/calib/tracked_probe.h"

namespace crumple {
namespace {

using testing::HasSubstr;

// Near each other, far from each other but of one station, of the other station.
std::vector<StripeReading> three_readings(const TrackedProbe& probe) {
  return {reading_of(probe, 0, {-60, -40, 780}), reading_of(probe, 0, {90, 70, 830}),
          reading_of(probe, 1, {40, -60, 800})};
}

TEST(PointUncertainty, SensitivitiesAreCentralDifferencesOfTheWholeChain) {
  TrackedProbe probe;
  Eigen::VectorXd sigma(probe.size());
  for (Eigen::Index i = 0; i < sigma.size(); ++i) sigma[i] = probe.scale_of(static_cast<std::size_t>(i));
  probe.truth.rig.covariance.matrix = Eigen::MatrixXd(sigma.cwiseAbs2().asDiagonal());
  const StationPoses poses = probe.poses(probe.truth.rig, probe.readings);
  const auto uncertainty = PointUncertainty::create(probe.truth.rig, poses);
  ASSERT_TRUE(uncertainty) << uncertainty.error().message;
  const StripeReading reading = three_readings(probe)[2];
  const Eigen::Vector3d point = in_world(probe.truth.rig, reading, probe.readings);
  const CloudShare share{0, 1, 1};
  PointSensitivity found;
  ASSERT_TRUE(uncertainty->sensitivity(point, {&share, 1}, found));
  // Variables of a diagonal covariance are the parameters over their sigmas; only their order is another.
  Eigen::MatrixXd expected(3, probe.size());
  for (Eigen::Index i = 0; i < probe.size(); ++i) {
    Eigen::VectorXd step = Eigen::VectorXd::Zero(probe.size());
    step[i] = sigma[i];
    expected.col(i) = 0.5 * (in_world(probe.moved(step), reading, probe.readings) -
                             in_world(probe.moved(-step), reading, probe.readings));
  }
  EXPECT_EQ(found.by_rig.cols(), probe.size());
  EXPECT_TRUE((found.by_rig * found.by_rig.transpose()).isApprox(expected * expected.transpose(), 1e-5));
  for (Eigen::Index i = 0; i < probe.size(); ++i) {
    double nearest = 1e9;
    for (Eigen::Index k = 0; k < probe.size(); ++k) {
      nearest = std::min(nearest, (found.by_rig.col(k) - expected.col(i)).norm());
    }
    EXPECT_LT(nearest, 1e-5) << probe.truth.rig.covariance.names[static_cast<std::size_t>(i)];
  }
  EXPECT_EQ(found.by_station.size(), 1U);
}

// Rigs drawn from a covariance that ties all parameters together, LED pixels from theirs: distances near and far,
// within a station and between two, scatter as predicted. Were the poses' share left out, or the points taken as
// independent, the ratios would be far from one.
TEST(PointUncertainty, DistancesScatterAsPredicted) {
  TrackedProbe probe;
  std::mt19937 random(7);
  const Eigen::MatrixXd root = correlated_root(probe, random);
  probe.truth.rig.covariance.matrix = root * root.transpose();
  const auto uncertainty =
      PointUncertainty::create(probe.truth.rig, probe.poses(probe.truth.rig, probe.readings)).value();
  const std::vector<StripeReading> readings = three_readings(probe);
  std::vector<PointSensitivity> sensitivities(3);
  std::vector<Eigen::Vector3d> truth;
  for (std::size_t i = 0; i < 3; ++i) {
    truth.push_back(in_world(probe.truth.rig, readings[i], probe.readings));
    const CloudShare share{0, static_cast<std::uint16_t>(readings[i].station), 1};
    ASSERT_TRUE(uncertainty.sensitivity(truth[i], {&share, 1}, sensitivities[i]));
  }
  const std::pair<std::size_t, std::size_t> distances[] = {{0, 1}, {0, 2}};
  double predicted[2], sums[2] = {};
  for (int d = 0; d < 2; ++d) {
    const auto [a, b] = distances[d];
    const Eigen::RowVector3d along = (truth[b] - truth[a]).normalized().transpose();
    const Eigen::RowVectorXd by_rig = along * (sensitivities[b].by_rig - sensitivities[a].by_rig);
    Eigen::RowVectorXd by_pose = Eigen::RowVectorXd::Zero(12);
    by_pose.segment<6>(6 * static_cast<Eigen::Index>(readings[b].station)) +=
        along * sensitivities[b].by_station[0].d_pose;
    by_pose.segment<6>(6 * static_cast<Eigen::Index>(readings[a].station)) -=
        along * sensitivities[a].by_station[0].d_pose;
    predicted[d] = by_rig.squaredNorm() + by_pose.dot(uncertainty.poses().covariance * by_pose.transpose());
  }
  constexpr int kDraws = 300;
  for (int draw = 0; draw < kDraws; ++draw) {
    const Rig rig = drawn_rig(probe, root, random);
    const std::vector<LedReadings> seen = drawn_readings(probe, random);
    std::vector<Eigen::Vector3d> found;
    for (const StripeReading& reading : readings) found.push_back(in_world(rig, reading, seen));
    for (int d = 0; d < 2; ++d) {
      const auto [a, b] = distances[d];
      const double error = (found[b] - found[a]).norm() - (truth[b] - truth[a]).norm();
      sums[d] += error * error / kDraws;
    }
  }
  // The variance of a variance over n draws is 2 / n of it: three sigmas are 24 %.
  for (int d = 0; d < 2; ++d) EXPECT_NEAR(sums[d] / predicted[d], 1, 0.24) << d;
  // Between stations the same distance is known far worse than within one.
  EXPECT_GT(predicted[1], 2 * predicted[0]);
}

TEST(PointUncertainty, AMergedPointIsTheMeanOfItsViews) {
  TrackedProbe probe;
  probe.truth.rig.covariance.matrix = Eigen::MatrixXd::Identity(probe.size(), probe.size()) * 1e-10;
  const auto uncertainty =
      PointUncertainty::create(probe.truth.rig, probe.poses(probe.truth.rig, probe.readings)).value();
  const Eigen::Vector3d point = in_world(probe.truth.rig, three_readings(probe)[0], probe.readings);
  const CloudShare first{0, 0, 1}, second{0, 1, 1}, both[] = {{0, 0, 0.25F}, {0, 1, 0.75F}};
  PointSensitivity a, b, merged;
  ASSERT_TRUE(uncertainty.sensitivity(point, {&first, 1}, a));
  ASSERT_TRUE(uncertainty.sensitivity(point, {&second, 1}, b));
  ASSERT_TRUE(uncertainty.sensitivity(point, both, merged));
  EXPECT_TRUE(merged.by_rig.isApprox(0.25 * a.by_rig + 0.75 * b.by_rig, 1e-9));
  const PointParts parts = uncertainty.parts(merged);
  const Eigen::Matrix3d stations = uncertainty.parts(a).station / 16 + uncertainty.parts(b).station * 9 / 16;
  EXPECT_TRUE(parts.station.isApprox(stations, 1e-6));
}

// A cloud's points of one view go by variables of their own.
TEST(PointUncertainty, PartsOfACloudAreThoseOfItsPoints) {
  TrackedProbe probe;
  std::mt19937 random(3);
  std::normal_distribution<double> normal;
  Eigen::MatrixXd root = Eigen::MatrixXd::NullaryExpr(probe.size(), probe.size(), [&] { return normal(random); });
  for (Eigen::Index i = 0; i < probe.size(); ++i) root.row(i) *= probe.scale_of(static_cast<std::size_t>(i));
  probe.truth.rig.covariance.matrix = Eigen::MatrixXd(root * root.transpose());
  const StationPoses poses = probe.poses(probe.truth.rig, probe.readings);
  const auto uncertainty = PointUncertainty::create(probe.truth.rig, poses);
  ASSERT_TRUE(uncertainty) << uncertainty.error().message;
  Cloud cloud{"world", {"a", "b"}, {{}, {}}};
  for (const std::size_t view : {0U, 1U}) {
    cloud.points[view].position_mm =
        poses.stations[poses.views[view].station].world_from_probe * Eigen::Vector3d(40, -30, 790);
    cloud.points[view].view = static_cast<std::uint16_t>(view);
  }
  const auto parts = uncertainty->parts(cloud, 1);
  ASSERT_TRUE(parts) << parts.error().message;
  for (const std::size_t view : {0U, 1U}) {
    const CloudShare share{static_cast<std::uint32_t>(view), static_cast<std::uint16_t>(view), 1};
    PointSensitivity sensitivity;
    ASSERT_TRUE(uncertainty->sensitivity(cloud.points[view].position_mm, {&share, 1}, sensitivity));
    const PointParts expected = uncertainty->parts(sensitivity);
    EXPECT_TRUE((*parts)[view].calibration.isApprox(expected.calibration, 1e-9));
    EXPECT_TRUE((*parts)[view].station.isApprox(expected.station, 1e-12));
  }
}

TEST(PointUncertainty, WhatDoesNotBelongTogetherIsRefused) {
  TrackedProbe probe;
  probe.truth.rig.covariance.matrix = Eigen::MatrixXd::Identity(probe.size(), probe.size()) * 1e-10;
  const StationPoses poses = probe.poses(probe.truth.rig, probe.readings);
  Cloud cloud{"world", {"a", "b"}, {{}}};
  cloud.points[0].position_mm = poses.stations[0].world_from_probe * Eigen::Vector3d(0, 0, -500);
  const auto behind = PointUncertainty::create(probe.truth.rig, poses)->parts(cloud, 1);
  ASSERT_FALSE(behind);
  EXPECT_THAT(behind.error().message, HasSubstr("point 0 lies where"));
  Rig other = probe.truth.rig;
  other.covariance.names.pop_back();
  other.covariance.matrix = other.covariance.matrix.topLeftCorner(probe.size() - 1, probe.size() - 1).eval();
  EXPECT_THAT(PointUncertainty::create(other, poses).error().message, HasSubstr("another rig"));
  other.covariance = {};
  EXPECT_THAT(PointUncertainty::create(other, poses).error().message, HasSubstr("no covariance"));
}

}  // namespace
}  // namespace crumple
