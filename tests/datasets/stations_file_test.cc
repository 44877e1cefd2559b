#include "datasets/stations_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/temporary_folder.h"

namespace crumple {
namespace {

using testing::HasSubstr;

Rig rig_of_a_pair() {
  Rig rig;
  const auto lens = Lens::undistorted("LENSMODEL_PINHOLE", {640, 480}, 800, 800, {319.5, 239.5});
  rig.sensors = {{"cam", SensorKind::camera, *lens, {}}, {"proj", SensorKind::projector, *lens, {}}};
  rig.sensors[1].sensor_from_mount.translation = {-200, 0, 0};
  rig.covariance = {{"cam.fx", "proj.translation_x"}, Eigen::Matrix2d::Identity()};
  rig.scale_lacks = {"the temperature is not stated"};
  return rig;
}

StationPoses two_stations() {
  StationPoses poses;
  for (const double turn : {0.1, -0.7}) {
    const Pose pose{rotation_from_vector({turn, 0.3, turn}), {turn, 1 / 3.0, 1e3}};
    add_station({turn > 0 ? "door, left" : "2", pose}, Eigen::MatrixXd::Constant(6, 2, turn / 3),
                Matrix6d::Identity() * turn * turn, poses);
  }
  poses.views = {{1, 0, 1, {0, 0.5}}, {0, 0, 1, {1.25}}};
  return poses;
}

TEST(StationsFile, WhatIsWrittenIsReadBack) {
  const TemporaryFolder home;
  const StationPoses poses = two_stations();
  ASSERT_TRUE(write_stations(home.path(), rig_of_a_pair(), poses));
  const auto read = read_stations(home.path());
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(read->rig.covariance.names, rig_of_a_pair().covariance.names);
  EXPECT_EQ(read->rig.scale_lacks, rig_of_a_pair().scale_lacks);
  EXPECT_EQ(read->poses.d_rig, poses.d_rig);
  EXPECT_EQ(read->poses.covariance, poses.covariance);
  for (std::size_t i = 0; i < 2; ++i) {
    EXPECT_EQ(read->poses.stations[i].name, poses.stations[i].name);
    EXPECT_EQ(read->poses.stations[i].world_from_probe.rotation.coeffs(),
              poses.stations[i].world_from_probe.rotation.coeffs());
    EXPECT_EQ(read->poses.views[i].station, poses.views[i].station);
    EXPECT_EQ(read->poses.views[i].projector, 1U);
    ASSERT_EQ(read->poses.views[i].angles_rad.size(), poses.views[i].angles_rad.size());
    EXPECT_NEAR(read->poses.views[i].angles_rad.back(), poses.views[i].angles_rad.back(), 1e-15);
  }
}

TEST(StationsFile, NoStationsAreReadBack) {
  const TemporaryFolder home;
  StationPoses none;
  none.d_rig.resize(0, 2);
  none.covariance.resize(0, 0);
  ASSERT_TRUE(write_stations(home.path(), rig_of_a_pair(), none));
  const auto read = read_stations(home.path());
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_TRUE(read->poses.stations.empty());
}

TEST(StationsFile, ThePosesAloneNeedNoFilesBesideThem) {
  const TemporaryFolder home;
  ASSERT_TRUE(write_stations(home.path(), rig_of_a_pair(), two_stations()));
  std::filesystem::remove_all(home / "rig");
  const auto poses = read_posed_stations(home / "stations.yaml");
  ASSERT_TRUE(poses) << poses.error().message;
  ASSERT_EQ(poses->size(), 2U);
  EXPECT_EQ((*poses)[0].name, "door, left");
  EXPECT_EQ((*poses)[1].world_from_probe.translation, two_stations().stations[1].world_from_probe.translation);
  replace_in(home / "stations.yaml", "id: \"2\"", "id: \"door, left\"");
  EXPECT_THAT(read_posed_stations(home / "stations.yaml").error().message, HasSubstr("is there already"));
  EXPECT_THAT(read_posed_stations(home / "none.yaml").error().message, HasSubstr("none.yaml"));
}

TEST(StationsFile, WhatDoesNotFitIsNamed) {
  const TemporaryFolder home;
  const auto message = [&](const std::string& old_text, const std::string& new_text) {
    EXPECT_TRUE(write_stations(home.path(), rig_of_a_pair(), two_stations()));
    replace_in(home / "stations.yaml", old_text, new_text);
    const auto read = read_stations(home.path());
    return read ? std::string("no error") : read.error().message;
  };
  EXPECT_THAT(message("camera: \"cam\"", "camera: \"proj\""), HasSubstr("no such sensor of the rig"));
  EXPECT_THAT(message("station: \"2\"", "station: \"3\""), HasSubstr("one of the stations above"));
  EXPECT_THAT(message("angles_deg: [0, ", "angles_deg: [x, "), HasSubstr("angles_deg"));
  EXPECT_THAT(message("stations/1", "stations/9"), HasSubstr("crumple-stations/1"));
  EXPECT_THAT(message("views:", "view:"), HasSubstr("views"));
  std::filesystem::copy_file(home / "stations_d_rig.npy", home / "stations_covariance.npy",
                             std::filesystem::copy_options::overwrite_existing);
  replace_in(home / "stations.yaml", "view:", "views:");
  EXPECT_THAT(read_stations(home.path()).error().message, HasSubstr("stations and rig want 12 x 12"));
}

}  // namespace
}  // namespace crumple
