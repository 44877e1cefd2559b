#include "calib/system_part.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/calib/made_system_data.h"

namespace crumple {
namespace {

using testing::ElementsAre;

std::vector<std::string> names_of(const CalibrationData& data) {
  std::vector<std::string> names;
  for (const SensorSpec& sensor : data.sensors) names.push_back(sensor.name);
  return names;
}

TEST(SystemPart, TheProbesSeesEveryBoardFromEveryStationAnew) {
  const CalibrationData whole = data_of(make_system({.stations = 4, .placements = 2, .tracker_placements = 3}));
  const SystemPart part = system_part(whole, Mount::probe);
  EXPECT_THAT(names_of(part.data), ElementsAre("cam0", "proj0"));
  EXPECT_THAT(part.sensors, ElementsAre(0, 1));
  EXPECT_THAT(part.data.placement_names,
              ElementsAre("placement_0 from station station_0", "placement_1 from station station_1",
                          "placement_0 from station station_2", "placement_1 from station station_3"));
  EXPECT_EQ(part.placements[2], BoardSighting(0, 2));
  EXPECT_THAT(part.data.board_of, ElementsAre(0, 0, 0, 0));
  EXPECT_EQ(part.data.observations.placement_count, 4U);
  EXPECT_TRUE(part.data.station_names.empty());
  EXPECT_TRUE(part.data.observations.leds.empty());
  ASSERT_EQ(part.data.observations.stripes.size(), 8U);
  EXPECT_EQ(part.data.observations.stripes[7].placement, 3U);
  EXPECT_FALSE(part.data.observations.stripes[7].station);
  EXPECT_EQ(part.data.pairs.size(), 4U);
}

TEST(SystemPart, TheTrackersSeeBoardsOfTheWorldAndLaterSetUpsHaveNoPart) {
  const CalibrationData whole =
      data_of(make_system({.stations = 6, .tracker_placements = 3, .room_leds = 4, .moved_trackers = true}));
  const SystemPart part = system_part(whole, Mount::world);
  EXPECT_THAT(names_of(part.data), ElementsAre("track0", "track1"));
  EXPECT_THAT(part.sensors, ElementsAre(2, 3));
  for (const SensorSpec& sensor : part.data.sensors) EXPECT_EQ(sensor.mount, Mount::probe);
  EXPECT_THAT(part.data.placement_names, ElementsAre("placement_1", "placement_2", "placement_3"));
  EXPECT_THAT(part.data.board_of, ElementsAre(1, 1, 1));
  EXPECT_TRUE(part.data.observations.stripes.empty());
  for (const CornerView& view : part.data.observations.corners) EXPECT_LT(view.sensor, 2U);
}

TEST(SystemPart, IsCutWhereNoBoardIsSeenFromBothSides) {
  CalibrationData whole =
      data_of(make_system({.trackers = 4, .projector = false, .stations = 2, .tracker_placements = 6}));
  ASSERT_EQ(joined_parts(whole, Mount::world).size(), 1U);
  EXPECT_EQ(joined_parts(whole, Mount::probe).size(), 1U);
  // track0 with track2 through placement 1, track2 with track3 through placement 2, track1 sees the others alone.
  std::erase_if(whole.observations.corners, [](const CornerView& view) {
    if (view.station) return false;
    if (view.placement == 1) return view.sensor != 1 && view.sensor != 3;
    if (view.placement == 2) return view.sensor != 3 && view.sensor != 4;
    return view.sensor != 2;
  });
  const std::vector<SystemPart> parts = joined_parts(whole, Mount::world);
  ASSERT_EQ(parts.size(), 2U);
  EXPECT_THAT(names_of(parts[0].data), ElementsAre("track0", "track2", "track3"));
  EXPECT_THAT(parts[0].sensors, ElementsAre(1, 3, 4));
  EXPECT_THAT(parts[0].data.placement_names, ElementsAre("placement_1", "placement_2"));
  EXPECT_THAT(names_of(parts[1].data), ElementsAre("track1"));
  EXPECT_THAT(parts[1].data.placement_names, ElementsAre("placement_3", "placement_4", "placement_5", "placement_6"));
  for (const CornerView& view : parts[1].data.observations.corners) EXPECT_EQ(view.sensor, 0U);
}

TEST(SystemPart, OfAMountWithoutSensorsIsEmpty) {
  CalibrationData whole = data_of(make_system({.stations = 4}));
  std::erase_if(whole.sensors, [](const SensorSpec& sensor) { return sensor.mount == Mount::world; });
  const SystemPart part = system_part(whole, Mount::world);
  EXPECT_TRUE(part.sensors.empty());
  EXPECT_TRUE(part.data.observations.corners.empty());
}

}  // namespace
}  // namespace crumple
