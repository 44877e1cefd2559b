// One file of every version of our formats that ever was, in tests/data: what a lab archived has to be read for ever.
// Captures have a test of their own (capture_versions_test.cc).
#include <fstream>

#include <gtest/gtest.h>

#include "datasets/calibration_record.h"
#include "datasets/cloud_file.h"
#include "datasets/output_folder.h"
#include "datasets/rig_file.h"
#include "datasets/scene_file.h"

namespace crumple {
namespace {

const std::filesystem::path kData = CRUMPLE_SOURCE_DIR "/tests/data";

TEST(RigVersions, OneIsRead) {
  const auto rig = read_rig(kData / "rigs/version_1");
  ASSERT_TRUE(rig) << rig.error().message;
  ASSERT_EQ(rig->sensors.size(), 2U);
  EXPECT_EQ(rig->sensors[0].lens.model(), "LENSMODEL_OPENCV5");
  EXPECT_EQ(rig->sensors[1].kind, SensorKind::projector);
  EXPECT_EQ(rig->sensors[1].sensor_from_mount.translation.x(), -235.21468070633023);
  EXPECT_EQ(rig->sigma_px.at("proj0.stripes"), 0.04831660759493074);
  EXPECT_EQ(rig->covariance.names.back(), "board.warp_y");
  EXPECT_EQ(rig->covariance.matrix.rows(), 26);
}

TEST(RigVersions, TwoIsRead) {
  const auto rig = read_rig(kData / "rigs/version_2");
  ASSERT_TRUE(rig) << rig.error().message;
  ASSERT_EQ(rig->sensors.size(), 4U);
  EXPECT_EQ(rig->sensors[1].mount, Mount::probe);
  EXPECT_EQ(rig->sensors[2].mount, Mount::world);
  EXPECT_EQ(rig->sensors[2].sensor_from_mount.translation, Eigen::Vector3d::Zero());
  ASSERT_EQ(rig->leds.size(), 5U);
  EXPECT_EQ(rig->leds[4].name, "e");
  EXPECT_EQ(rig->leds[4].position_mm, Eigen::Vector3d(214.58, 54.81, -140.3));
}

TEST(PlacementsVersions, OneIsRead) {
  const auto record = read_calibration_record(kData / "rigs/version_1");
  ASSERT_TRUE(record) << record.error().message;
  ASSERT_TRUE(*record);
  const Placements& placements = (*record)->placements;
  EXPECT_EQ(placements.boards.at(0).warp_mm.x(), 0.1811622256744434);
  EXPECT_EQ(placements.placements.at(1).name, "board_02");
  EXPECT_EQ(placements.placements.at(1).world_from_board.translation.z(), 743.7271500499859);
  EXPECT_EQ((*record)->corners.size(), 1U);
}

TEST(PlacementsVersions, TwoIsRead) {
  const auto text = read_file(kData / "rigs/version_2/placements.yaml");
  ASSERT_TRUE(text) << text.error().message;
  const auto placements = parse_placements(*text, "placements.yaml");
  ASSERT_TRUE(placements) << placements.error().message;
  EXPECT_EQ(placements->placements.at(1).name, "bench_b");
  EXPECT_EQ(placements->placements.at(1).world_from_board.translation.z(), 2738.045867068248);
  EXPECT_EQ(placements->stations.at(1).name, "cal_02");
  EXPECT_EQ(placements->stations.at(0).world_from_probe.translation.x(), 58.5172817897305);
}

TEST(SceneVersions, OneIsRead) {
  const auto scene = read_scene(kData / "scenes/version_1.yaml");
  ASSERT_TRUE(scene) << scene.error().message;
  EXPECT_EQ(scene->stations.size(), 5U);
  EXPECT_EQ(scene->board->target().columns, 9);
  EXPECT_EQ(scene->projector->sensor.lens.parameters()[3], 270.6);
  EXPECT_EQ(scene->seed, 7U);
}

TEST(SceneVersions, TwoIsRead) {
  const auto scene = read_scene(kData / "scenes/version_2.yaml");
  ASSERT_TRUE(scene) << scene.error().message;
  EXPECT_EQ(scene->tracking.trackers.size(), 2U);
  EXPECT_EQ(scene->tracking.leds.size(), 5U);
  EXPECT_EQ(scene->tracking.mirrors.size(), 1U);
  EXPECT_EQ(scene->tracking.lamps.size(), 1U);
  EXPECT_EQ(scene->tracking.blink_start, 5U);
  EXPECT_EQ(scene->stations.size(), 21U);
  EXPECT_EQ(scene->stations[4].placement, "bench_a");
}

TEST(CloudVersions, OneIsRead) {
  const std::filesystem::path file = kData / "clouds/version_1.ply";
  std::ifstream stream(file, std::ios::binary);
  const auto cloud = read_cloud(stream, std::filesystem::file_size(file));
  ASSERT_TRUE(cloud) << cloud.error().message;
  EXPECT_FALSE(cloud->points.empty());
  EXPECT_FALSE(cloud->stations.empty());
}

}  // namespace
}  // namespace crumple
