#include "calib/view_offsets.h"

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
TEST(ViewOffsets, ScatterAsPredicted) {
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
  const std::vector<ViewOffset> offsets = view_offsets(cloud, uncertainty);
  ASSERT_EQ(offsets.size(), 2U);
  EXPECT_EQ(offsets[0].points, 0U);
  EXPECT_EQ(offsets[1].points, cloud.points.size());

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
  EXPECT_NEAR(sum / (offsets[1].sigma_mm * offsets[1].sigma_mm), 1, 0.24);
}

// A chain: the first two views share the left of a patch, the last two its right. What comes later changes nothing of
// what is said of the second, and on the third's side the second alone counts.
TEST(ViewOffsets, AreAgainstEarlierViewsAlone) {
  TrackedProbe probe;
  probe.truth.rig.covariance.matrix = Eigen::MatrixXd::Identity(probe.size(), probe.size()) * 1e-10;
  StationPoses poses = probe.poses(probe.truth.rig, probe.readings);
  poses.views.push_back({0, 0, 1, {0.1}});
  const auto uncertainty = PointUncertainty::create(probe.truth.rig, poses).value();
  const auto cloud_of = [&](bool left, bool right) {
    Cloud cloud{"world", {"a", "b"}, {}};
    for (const Eigen::Vector3d& at : patch(probe)) {
      const bool is_left = cloud.points.size() % 2 == 0;
      cloud.points.emplace_back();
      cloud.points.back().position_mm = at;
      cloud.points.back().normal = -Eigen::Vector3f::UnitZ();
      const auto number = static_cast<std::uint32_t>(cloud.points.size() - 1);
      if (is_left && left) cloud.shares.push_back({number, 0, 0.5F});
      cloud.shares.push_back({number, 1, 0.5F});
      if (!is_left && right) cloud.shares.push_back({number, 2, 0.5F});
    }
    return cloud;
  };
  const auto whole = view_offsets(cloud_of(true, true), uncertainty);
  const auto first_two = view_offsets(cloud_of(true, false), uncertainty);
  const auto last_two = view_offsets(cloud_of(false, true), uncertainty);
  ASSERT_EQ(whole.size(), 3U);
  EXPECT_EQ(whole[1].points, 5U);
  EXPECT_EQ(whole[2].points, 4U);
  EXPECT_EQ(whole[1].sigma_mm, first_two[1].sigma_mm);
  EXPECT_EQ(whole[2].sigma_mm, last_two[2].sigma_mm);
  EXPECT_GT(whole[1].sigma_mm, 0);
}

TEST(ViewOffsets, AreNoneWhereStationsShareNothing) {
  TrackedProbe probe;
  probe.truth.rig.covariance.matrix = Eigen::MatrixXd::Identity(probe.size(), probe.size()) * 1e-10;
  const auto uncertainty =
      PointUncertainty::create(probe.truth.rig, probe.poses(probe.truth.rig, probe.readings)).value();
  Cloud cloud{"world", {"a", "b"}, {{}}};
  cloud.points[0].position_mm = patch(probe)[0];
  for (const ViewOffset& offset : view_offsets(cloud, uncertainty)) EXPECT_EQ(offset.points, 0U);
}

}  // namespace
}  // namespace crumple
