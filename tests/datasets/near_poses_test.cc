// Poses of an earlier run, and whether they are in the frame of the rig at hand.
#include "datasets/near_poses.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "datasets/stations_file.h"
#include "tests/temporary_folder.h"

namespace crumple {
namespace {

using testing::AllOf;
using testing::HasSubstr;

constexpr double kDegree = 0.017453292519943295;

Rig rig_of_trackers(const std::vector<std::string>& names) {
  const auto lens = Lens::undistorted("LENSMODEL_PINHOLE", {640, 480}, 800, 800, {319.5, 239.5});
  Rig rig;
  for (const std::string& name : names) {
    Pose sensor_from_world;
    if (name != names.front()) sensor_from_world = {rotation_from_vector({0, 0.4, 0}), {-900, 20, 200}};
    rig.sensors.push_back({name, SensorKind::camera, *lens, sensor_from_world, Mount::world});
  }
  rig.covariance = {{names.front() + ".fx"}, Eigen::MatrixXd::Identity(1, 1)};
  return rig;
}

// The tracker turned about its own centre, and then shifted, in the world's frame.
Rig with_moved(Rig rig, const std::string& name, const Eigen::Vector3d& turn_rad, const Eigen::Vector3d& shift_mm) {
  Pose& sensor_from_world = rig.sensors[*rig.find(name)].sensor_from_mount;
  Pose world_from_sensor = sensor_from_world.inverse();
  world_from_sensor.rotation = rotation_from_vector(turn_rad) * world_from_sensor.rotation;
  world_from_sensor.translation += shift_mm;
  sensor_from_world = world_from_sensor.inverse();
  return rig;
}

void write_run(const std::filesystem::path& folder, const Rig& rig) {
  StationPoses poses;
  add_station({"door_1", {}}, Eigen::MatrixXd::Zero(6, 1), Matrix6d::Identity(), poses);
  ASSERT_TRUE(write_stations(folder, rig, poses));
}

// "" where the poses of a run with one rig may be stated for another.
std::string refusal(const Rig& earlier, const Rig& now) {
  const TemporaryFolder run;
  write_run(run.path(), earlier);
  const auto by_folder = NearPoses::create(run.path().string(), now);
  const auto by_file = NearPoses::create((run / "stations.yaml").string(), now);
  EXPECT_EQ(by_folder.has_value(), by_file.has_value());
  return by_folder ? "" : by_folder.error().message;
}

TEST(NearPoses, ARunWithTheTrackersWhereTheyAreIsTaken) {
  const Rig rig = rig_of_trackers({"left", "right"});
  EXPECT_EQ(refusal(rig, rig), "");
  // What two calibrations of the same trackers may differ by.
  EXPECT_EQ(refusal(rig, with_moved(rig, "right", {0.2 * kDegree, 0, -0.3 * kDegree}, {4, -3, 8})), "");
}

TEST(NearPoses, ARunBeforeATrackerWasMovedIsRefused) {
  const Rig rig = rig_of_trackers({"left", "right"});
  EXPECT_THAT(refusal(rig, with_moved(rig, "right", {0, 0, 2 * kDegree}, {0, 0, 0})),
              AllOf(HasSubstr("stations.yaml: right stands 2.0 deg and 0 mm from where it is in --rig, seen from left"),
                    HasSubstr("in another frame")));
  EXPECT_THAT(refusal(rig, with_moved(rig, "right", {0, 0, 0}, {0, 40, 0})), HasSubstr("0.0 deg and 40 mm"));
  EXPECT_THAT(refusal(rig_of_trackers({"left", "right", "third"}), with_moved(rig, "right", {0, 0.1, 0}, {0, 0, 0})),
              HasSubstr("right stands"));
}

TEST(NearPoses, ARunInAnotherTrackersFrameIsRefused) {
  EXPECT_THAT(refusal(rig_of_trackers({"right", "left"}), rig_of_trackers({"left", "right"})),
              HasSubstr("the first tracker of its rig is right, not left"));
  Rig untracked = rig_of_trackers({"left"});
  untracked.sensors[0].mount = Mount::probe;
  EXPECT_THAT(refusal(untracked, rig_of_trackers({"left"})), HasSubstr("the first tracker of its rig is none"));
}

// Nor does a rig that merely lies there.
TEST(NearPoses, AFileByItselfHasNoRigToCompareWith) {
  const TemporaryFolder home;
  write_run(home.path(), rig_of_trackers({"right", "left"}));
  std::filesystem::remove(home / "stations_d_rig.npy");
  const auto rig = read_rig_of_stations(home / "stations.yaml");
  ASSERT_TRUE(rig) << rig.error().message;
  EXPECT_FALSE(*rig);
  EXPECT_TRUE(NearPoses::create(home.path().string(), rig_of_trackers({"left", "right"})));
}

TEST(NearPoses, ADamagedRigBesideTheFileIsNamed) {
  const TemporaryFolder home;
  write_run(home.path(), rig_of_trackers({"left", "right"}));
  std::filesystem::remove(home / "rig/right.cameramodel");
  const auto near = NearPoses::create(home.path().string(), rig_of_trackers({"left", "right"}));
  ASSERT_FALSE(near);
  EXPECT_THAT(near.error().message, HasSubstr("right.cameramodel"));
}

}  // namespace
}  // namespace crumple
