#include "calib/room_targets.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace crumple {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;
using testing::SizeIs;

const Pose kWorldFromBoard{Eigen::Quaterniond(Eigen::AngleAxisd(0.3, Eigen::Vector3d(1, 2, 0.5).normalized())),
                           {40, -25, 900}};
const std::vector<Pose> kStations{
    {Eigen::Quaterniond::Identity(), {0, 0, 0}},
    {Eigen::Quaterniond(Eigen::AngleAxisd(0.2, Eigen::Vector3d::UnitY())), {-180, 10, 20}},
    {Eigen::Quaterniond(Eigen::AngleAxisd(-0.15, Eigen::Vector3d::UnitX())), {10, -140, -15}}};

class RoomTargetsTest : public testing::Test {
 protected:
  RoomTargetsTest() {
    const std::vector<double> lens{1400, 1398, 515, 380, -0.1, 0.08, 0.0005, -0.0003};
    rig_.sensors.push_back({"cam0", SensorKind::camera, Lens::create("LENSMODEL_OPENCV4", {1024, 768}, lens).value(),
                            Pose{Eigen::Quaterniond(Eigen::AngleAxisd(0.1, Eigen::Vector3d::UnitZ())), {12, -7, 5}}});
  }

  BoardSight sight(std::size_t station, std::vector<int> corners) const {
    const Sensor& camera = rig_.sensors[0];
    BoardSight seen{station, 0, 0, "bench", std::move(corners), {}};
    for (const int corner : seen.corners)
      seen.pixels.push_back(
          *camera.lens.project(camera.sensor_from_mount * kStations[station].inverse() * place_mm(corner)));
    return seen;
  }

  Eigen::Vector3d place_mm(int corner) const { return kWorldFromBoard * board_of(boards_[0].target).point(corner); }

  Rig rig_;
  std::vector<BoardSpec> boards_{{"board", {5, 4, 30}, {}}};
};

TEST_F(RoomTargetsTest, LieWhereTheyAreInTheWorld) {
  const RoomTargets found =
      room_targets(rig_, kStations, boards_, {sight(0, {0, 1, 6, 12, 19}), sight(1, {0, 6, 12, 13, 19})});
  std::vector<std::string> names;
  for (const RoomTarget& target : found.targets) names.push_back(target.name);
  EXPECT_THAT(names, ElementsAre("bench/board/0", "bench/board/6", "bench/board/12", "bench/board/19"));
  for (const int i : {0, 1, 2, 3}) {
    const int corner = std::vector<int>{0, 6, 12, 19}[static_cast<std::size_t>(i)];
    EXPECT_LT((found.targets[static_cast<std::size_t>(i)].position_mm - place_mm(corner)).norm(), 1e-6) << corner;
  }
  ASSERT_THAT(found.readings, SizeIs(3));
  ASSERT_THAT(found.readings[1], SizeIs(1));
  EXPECT_THAT(found.readings[1][0].targets, ElementsAre(0, 1, 2, 3));
  EXPECT_EQ(found.readings[1][0].pixels[2], sight(1, {12}).pixels[0]);
  EXPECT_THAT(found.readings[2], IsEmpty());
}

TEST_F(RoomTargetsTest, AreNoneWhereABoardWasPutElsewhereOrSeenOnce) {
  BoardSight moved = sight(1, {0, 6, 12, 19});
  moved.placement = "floor";
  EXPECT_THAT(room_targets(rig_, kStations, boards_, {sight(0, {0, 6, 12, 19}), moved}).targets, IsEmpty());
  EXPECT_THAT(room_targets(rig_, kStations, boards_, {sight(0, {0, 1, 6, 12}), sight(1, {13, 14, 15, 19})}).targets,
              IsEmpty());
}

// Three corners on a line tell no pose.
TEST_F(RoomTargetsTest, DoWithoutASightThatTellsNoPose) {
  const RoomTargets found = room_targets(rig_, kStations, boards_,
                                         {sight(2, {0, 1, 2}), sight(0, {0, 1, 2, 6, 13}), sight(1, {0, 1, 6, 13})});
  EXPECT_THAT(found.targets, SizeIs(4));
  EXPECT_THAT(found.readings[2], IsEmpty());
}

}  // namespace
}  // namespace crumple
