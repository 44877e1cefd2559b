// One file of every version of every format of ours that is read, in tests/data: what a lab archived has to be read for
// ever. Captures have a test of their own (capture_versions_test.cc). Nothing of ours reads true-stations/1 and /2,
// hand-eye/1 and what is printed as JSON (summary.json, measurement/1, vdi2634-report/1): these are written only, and
// no file of them is kept.
#include <fstream>
#include <numbers>
#include <set>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "datasets/calibration_record.h"
#include "datasets/cloud_file.h"
#include "datasets/measuring_plan.h"
#include "datasets/output_folder.h"
#include "datasets/rig_file.h"
#include "datasets/scene_file.h"
#include "datasets/stations_file.h"
#include "solvers/body_motion.h"
#include "solvers/parameters.h"
#include "solvers/rig_covariance.h"

namespace crumple {
namespace {

using testing::ElementsAre;

const std::filesystem::path kData = CRUMPLE_SOURCE_DIR "/tests/data";

// What readers of a covariance look its rows up by: lenses and mounts that were estimated, LEDs, the board, both
// datums.
std::vector<std::string> rows_by_todays_names(const Rig& rig) {
  CalibrationState state{rig, {Board{}}, {}, {}};
  state.boards.front().name = "board";
  std::vector<BlockId> blocks;
  std::set<Mount> held;
  for (std::size_t s = 0; s < rig.sensors.size(); ++s) {
    if (!rig.sensors[s].lens_of) blocks.push_back({BlockId::Kind::lens, s});
    if (!held.insert(rig.sensors[s].mount).second) blocks.push_back({BlockId::Kind::mount, s});
  }
  for (std::size_t l = 0; l < rig.leds.size(); ++l) blocks.push_back({BlockId::Kind::led, l});
  blocks.push_back({BlockId::Kind::warp, 0});
  blocks.push_back({BlockId::Kind::scale, 0});
  std::vector<std::string> rows;
  for (const BlockId& block : blocks) {
    const std::vector<std::string> of_block = parameter_names(block, state);
    rows.insert(rows.end(), of_block.begin(), of_block.end());
  }
  for (const Mount mount : {Mount::probe, Mount::world}) {
    const std::vector<std::string> of_mount = datum_names(mount);
    rows.insert(rows.end(), of_mount.begin(), of_mount.end());
  }
  return rows;
}

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

// Calibrated: two trackers, one of which was moved half-way, and a board with a certificate.
TEST(RigVersions, TwoIsReadWithItsCovariance) {
  const auto rig = read_rig(kData / "rigs/version_2_calibrated");
  ASSERT_TRUE(rig) << rig.error().message;
  ASSERT_EQ(rig->sensors.size(), 4U);
  EXPECT_EQ(rig->sensors[3].name, "tracker1b");
  EXPECT_EQ(rig->sensors[3].lens_of, 2U);
  EXPECT_EQ(rig->sensors[3].sensor_from_mount.translation.x(), -884.28245219028);
  EXPECT_EQ(rig->sensors[3].lens.parameters()[8], 0.023254389359016643);
  EXPECT_EQ(rig->leds[4].position_mm.z(), -139.2879259479417);
  EXPECT_EQ(rig->sigma_px.at("tracker1b.leds"), 0.002534574095947434);
  EXPECT_EQ(rig->covariance.names, rows_by_todays_names(*rig));
  const auto covariance = [&](const std::string& row, const std::string& column) {
    const Eigen::MatrixXd of_both = covariance_of(rig->covariance, {row, column});
    return of_both(0, 1);
  };
  EXPECT_EQ(covariance("a.x", "a.x"), 0.011458436890706804);
  EXPECT_EQ(covariance("a.x", "cam0.fx"), -0.004017703008642321);
  EXPECT_EQ(covariance("tracker1b.translation_z", "tracker1b.translation_z"), 0.1763201897188646);
  EXPECT_EQ(covariance("board.scale", "board.scale"), 5.918934240362819e-10);
  EXPECT_EQ(covariance("probe.datum_rotation_x", "probe.datum_rotation_x"), 2.1951395889591161e-07);
  EXPECT_EQ(covariance("world.datum_translation_z", "e.z"), 0.0021850263571751905);
  EXPECT_THAT(rig->scale_lacks, ElementsAre("whether its certificates were complete was not recorded with the rig"));
}

// Of a board whose certificate lacks a part.
TEST(RigVersions, ThreeIsRead) {
  const auto rig = read_rig(kData / "rigs/version_3");
  ASSERT_TRUE(rig) << rig.error().message;
  ASSERT_EQ(rig->sensors.size(), 2U);
  EXPECT_EQ(rig->sensors[1].sensor_from_mount.translation.x(), -200);
  EXPECT_THAT(rig->scale_lacks, ElementsAre("the thermal expansion of board 'board' is not stated",
                                            "the temperature during the calibration is not stated"));
  EXPECT_THAT(rig->covariance.names, ElementsAre("cam.fx", "proj.translation_x", "board.scale"));
  EXPECT_EQ(rig->covariance.matrix(2, 2), 0x1p-30);
  EXPECT_EQ(rig->covariance.matrix(1, 2), -0x1p-18);
}

// Of a calibration that was rejected.
TEST(RigVersions, FourIsRead) {
  const auto rig = read_rig(kData / "rigs/version_4");
  ASSERT_TRUE(rig) << rig.error().message;
  EXPECT_TRUE(rig->rejected);
  EXPECT_THAT(rig->doubts, ElementsAre("cam: the focal length is known to 12.0 % only: add tilts and distances",
                                       "2 board placements only"));
  EXPECT_EQ(rig->scale_lacks.size(), 2U);
  EXPECT_EQ(rig->covariance.matrix(1, 2), -0x1p-18);
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

// Three points of two stations, the last merged of both views; with columns of a thermal camera and of uncertainty.
TEST(CloudVersions, TwoIsRead) {
  const auto cloud = read_cloud(kData / "clouds/version_2.ply");
  ASSERT_TRUE(cloud) << cloud.error().message;
  EXPECT_EQ(cloud->frame, "world");
  EXPECT_THAT(cloud->stations, ElementsAre("door_1", "door_2"));
  ASSERT_EQ(cloud->points.size(), 3U);
  EXPECT_EQ(cloud->points[0].position_mm, Eigen::Vector3d(-130.25, 118.5, 2766));
  const CloudPoint& point = cloud->points[2];
  EXPECT_EQ(point.position_mm, Eigen::Vector3d(0.5, -0.125, 3000));
  EXPECT_EQ(point.normal, Eigen::Vector3f(0.6F, 0, -0.8F));
  EXPECT_EQ(point.intensity, 0.125F);
  EXPECT_EQ(point.sigma_mm, 0.046875F);
  EXPECT_EQ(point.covariance_mm2(1, 0), 0.00048828125F);
  EXPECT_EQ(point.covariance_mm2(2, 2), 0.0009765625F);
  EXPECT_EQ(point.station, 1);
  EXPECT_EQ(point.quality, 0.5F);
  EXPECT_EQ(point.view, 1);
  ASSERT_EQ(cloud->shares.size(), 2U);
  EXPECT_EQ(cloud->shares[1].point, 2U);
  EXPECT_EQ(cloud->shares[1].view, 1);
  EXPECT_EQ(cloud->shares[1].weight, 0.75F);
}

TEST(StationsVersions, OneIsRead) {
  const auto read = read_stations(kData / "stations/version_1");
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_THAT(read->rig.covariance.names, ElementsAre("cam.fx", "proj.translation_x"));
  const StationPoses& poses = read->poses;
  ASSERT_EQ(poses.stations.size(), 2U);
  EXPECT_EQ(poses.stations[0].name, "door, left");
  EXPECT_EQ(poses.stations[1].world_from_probe.translation, Eigen::Vector3d(-300, 40.125, 1900.5));
  EXPECT_EQ(poses.stations[1].world_from_probe.rotation.coeffs(), Eigen::Vector4d(-0.5, 0.5, 0.5, 0.5));  // x y z w
  ASSERT_EQ(poses.views.size(), 2U);
  EXPECT_EQ(poses.views[0].station, 1U);
  EXPECT_EQ(poses.views[0].projector, 1U);
  ASSERT_EQ(poses.views[0].angles_rad.size(), 2U);
  EXPECT_NEAR(poses.views[0].angles_rad[1], std::numbers::pi / 2, 1e-15);
  ASSERT_EQ(poses.d_rig.rows(), 12);
  EXPECT_EQ(poses.d_rig(11, 1), 11 / 8.0 + 1 / 64.0);
  EXPECT_EQ(poses.covariance(11, 11), 12 / 1024.0);
  EXPECT_EQ(poses.covariance(11, 10), 0);
}

TEST(MeasureVersions, OneIsRead) {
  const auto plan = read_measuring_plan(kData / "plans/measure_1.yaml");
  ASSERT_TRUE(plan) << plan.error().message;
  ASSERT_EQ(plan->features.size(), 5U);
  EXPECT_EQ(plan->features[1].name, "lock");
  EXPECT_EQ(plan->features[1].near_mm, Eigen::Vector3d(210.5, 96.1, 2801.3));
  EXPECT_EQ(plan->features[1].radius_mm, 4);
  EXPECT_EQ(plan->features[2].kind, PlannedFeature::Kind::plane);
  ASSERT_TRUE(plan->features[2].box_mm);
  EXPECT_EQ(plan->features[2].box_mm->max(), Eigen::Vector3d(200, 320, 2900));
  EXPECT_EQ(plan->features[4].kind, PlannedFeature::Kind::sphere);
  EXPECT_THAT(plan->distances, ElementsAre(ElementsAre(0, 1), ElementsAre(4, 2)));
  EXPECT_THAT(plan->angles, ElementsAre(ElementsAre(0, 4, 1), ElementsAre(2, 3)));
}

TEST(Vdi2634Versions, OneIsRead) {
  const auto plan = read_acceptance_plan(kData / "plans/vdi2634_1.yaml");
  ASSERT_TRUE(plan) << plan.error().message;
  ASSERT_EQ(plan->features.size(), 3U);
  EXPECT_EQ(plan->features[2].kind, PlannedFeature::Kind::plane);
  EXPECT_EQ(plan->features[2].radius_mm, 60);
  ASSERT_EQ(plan->diameters.size(), 2U);
  EXPECT_EQ(plan->diameters[1].length_mm, 50.0011);
  EXPECT_EQ(plan->diameters[1].sigma_mm, 0.0005);
  ASSERT_EQ(plan->bars.size(), 1U);
  EXPECT_EQ(plan->bars[0].name, "bar");
  EXPECT_EQ(plan->bars[0].to, 1U);
  EXPECT_EQ(plan->bars[0].length.length_mm, 300.0125);
  EXPECT_EQ(plan->bars[0].length.sigma_mm, 0.0015);
  EXPECT_EQ(plan->limits_mm.size(), 5U);
  EXPECT_EQ(plan->limits_mm.at("sphere_spacing"), 0.15);
}

}  // namespace
}  // namespace crumple
