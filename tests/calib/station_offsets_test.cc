#include "calib/station_offsets.h"

#include <gtest/gtest.h>

#include "tests/calib/tracked_probe.h"

namespace crumple {
namespace {

// A patch of surface before the first station, as both stations see it.
std::vector<Eigen::Vector3d> patch(const TrackedProbe& probe) {
  const Pose& world_from_probe = probe.truth.world_from_probe[0];
  std::vector<Eigen::Vector3d> points;
  for (const double x_mm : {-60.0, 0.0, 60.0}) {
    for (const double y_mm : {-50.0, 0.0, 50.0}) points.push_back(world_from_probe * Eigen::Vector3d(x_mm, y_mm, 800));
  }
  return points;
}

// Rigs and LED pixels drawn anew: by how much one station's points lie over the other's, on average, scatters as told.
TEST(StationOffsets, ScatterAsPredicted) {
  TrackedProbe probe;
  std::mt19937 random(11);
  const Eigen::MatrixXd root = correlated_root(probe, random);
  probe.truth.rig.covariance.matrix = root * root.transpose();
  const auto uncertainty =
      PointUncertainty::create(probe.truth.rig, probe.poses(probe.truth.rig, probe.readings)).value();
  const Eigen::Vector3d normal = -(probe.truth.world_from_probe[0].rotation * Eigen::Vector3d::UnitZ());
  Cloud cloud{"world", {"a", "b"}, {}};
  std::vector<StripeReading> readings;
  for (const Eigen::Vector3d& point : patch(probe)) {
    const auto number = static_cast<std::uint32_t>(cloud.points.size());
    cloud.points.emplace_back();
    cloud.points.back().position_mm = point;
    cloud.points.back().normal = normal.cast<float>();
    cloud.shares.push_back({number, 0, 0.4F});
    cloud.shares.push_back({number, 1, 0.6F});
    for (const std::size_t station : {0U, 1U}) {
      readings.push_back(reading_of(probe, station, probe.truth.world_from_probe[station].inverse() * point));
    }
  }
  const std::vector<StationOffset> offsets = station_offsets(cloud, uncertainty);
  ASSERT_EQ(offsets.size(), 2U);
  EXPECT_EQ(offsets[0].points, cloud.points.size());
  EXPECT_NEAR(offsets[0].sigma_mm, offsets[1].sigma_mm, 1e-9);

  constexpr int kDraws = 300;
  double sum = 0;
  for (int draw = 0; draw < kDraws; ++draw) {
    const Rig rig = drawn_rig(probe, root, random);
    const std::vector<LedReadings> seen = drawn_readings(probe, random);
    double offset_mm = 0;
    for (std::size_t i = 0; i < readings.size(); i += 2) {
      offset_mm += normal.dot(in_world(rig, readings[i + 1], seen) - in_world(rig, readings[i], seen));
    }
    offset_mm /= static_cast<double>(cloud.points.size());
    sum += offset_mm * offset_mm / kDraws;
  }
  // The variance of a variance over n draws is 2 / n of it: three sigmas are 24 %.
  EXPECT_NEAR(sum / (offsets[0].sigma_mm * offsets[0].sigma_mm), 1, 0.24);
}

TEST(StationOffsets, AreNoneWhereStationsShareNothing) {
  TrackedProbe probe;
  probe.truth.rig.covariance.matrix = Eigen::MatrixXd::Identity(probe.size(), probe.size()) * 1e-10;
  const auto uncertainty =
      PointUncertainty::create(probe.truth.rig, probe.poses(probe.truth.rig, probe.readings)).value();
  Cloud cloud{"world", {"a", "b"}, {{}}};
  cloud.points[0].position_mm = patch(probe)[0];
  for (const StationOffset& offset : station_offsets(cloud, uncertainty)) EXPECT_EQ(offset.points, 0U);
}

}  // namespace
}  // namespace crumple
