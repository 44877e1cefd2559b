// A whole system from nothing but observations: closed forms over the graph of who sees what, then the joint
// refinement.
#include <algorithm>
#include <random>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "calib/calibrate.h"
#include "calib/moved_sensor.h"
#include "calib/verdict.h"
#include "tests/calib/made_system_data.h"
#include "tests/solvers/noisy_observations.h"

namespace crumple {
namespace {

using testing::AllOf;
using testing::Contains;
using testing::Each;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;
using testing::UnorderedElementsAre;

const CalibrationOptions kFlat{.warp = WarpChoice::off};

// Of sensors fixed to the world, by their numbers: each group sees boards of its own only, in turns.
void share_out_boards(const std::vector<std::set<std::size_t>>& groups, MadeSystem& made) {
  std::erase_if(made.observations.corners, [&](const CornerView& view) {
    return !view.station && !groups[view.placement % groups.size()].contains(view.sensor);
  });
}

struct SystemCase {
  const char* name;
  MadeSystemOptions options;
  void (*change)(MadeSystem&) = nullptr;
};

class CalibrateSystem : public testing::TestWithParam<SystemCase> {};

TEST_P(CalibrateSystem, RecoversTheTruthFromNoiseFreeObservations) {
  MadeSystemOptions options = GetParam().options;
  options.led_sigma_px = options.corner_sigma_px = options.stripe_sigma_px = 0;
  MadeSystem made = make_system(options);
  if (GetParam().change != nullptr) GetParam().change(made);
  const auto found = calibrate(data_of(made), kFlat);
  ASSERT_TRUE(found) << found.error().message;
  for (std::size_t s = 0; s < made.truth.rig.sensors.size(); ++s) {
    const Sensor& truth = made.truth.rig.sensors[s];
    const Sensor& sensor = found->bundle.state.rig.sensors[s];
    EXPECT_EQ(sensor.mount, truth.mount);
    EXPECT_LT(local_step(truth.sensor_from_mount, sensor.sensor_from_mount).norm(), 1e-4) << truth.name;
  }
  for (std::size_t l = 0; l < made.truth.rig.leds.size(); ++l) {
    EXPECT_LT((found->bundle.state.rig.leds[l].position_mm - made.truth.rig.leds[l].position_mm).norm(), 1e-4) << l;
  }
  for (std::size_t s = 0; s < made.truth.world_from_probe.size(); ++s) {
    EXPECT_LT(local_step(made.truth.world_from_probe[s], found->bundle.state.world_from_probe[s]).norm(), 1e-4) << s;
  }
}

INSTANTIATE_TEST_SUITE_P(
    AnyPart, CalibrateSystem,
    testing::Values(
        SystemCase{"Whole", {.stations = 12, .placements = 2}},
        SystemCase{"TwoCamerasAndTwoProjectors", {.second_pair = true, .stations = 14}},
        SystemCase{"MovedTrackers", {.projector = false, .stations = 20, .room_leds = 6, .moved_trackers = true}},
        SystemCase{"MovedTrackersTiedByTheBoard", {.projector = false, .stations = 20, .moved_trackers = true}},
        SystemCase{"OneTracker", {.trackers = 1, .projector = false, .stations = 14}},
        SystemCase{"OneTrackerAndFourStationsABoard",
                   {.trackers = 1, .leds = 6, .projector = false, .stations = 11, .placements = 3}},
        SystemCase{"FourTrackersAndAWand",
                   {.trackers = 4, .leds = 8, .projector = false, .stations = 12, .wand_stations = 10}},
        SystemCase{"TrackersWithBoardsOfTheirOwn",
                   {.projector = false, .stations = 14, .tracker_placements = 16},
                   [](MadeSystem& made) {
                     share_out_boards({{1}, {2}}, made);
                   }},
        SystemCase{"TwoPairsOfTrackersWithBoardsOfTheirOwn",
                   {.trackers = 4, .projector = false, .stations = 12, .tracker_placements = 16},
                   [](MadeSystem& made) {
                     share_out_boards({{1, 2}, {3, 4}}, made);
                   }},
        SystemCase{"TheFirstTrackerWithBoardsOfItsOwn",
                   {.trackers = 3, .projector = false, .stations = 12, .tracker_placements = 16},
                   [](MadeSystem& made) {
                     share_out_boards({{1}, {2, 3}}, made);
                   }},
        SystemCase{"TrackersTiedByReferencesAlone",
                   {.trackers = 3, .projector = false, .stations = 12, .tracker_placements = 16, .room_leds = 6},
                   [](MadeSystem& made) {
                     share_out_boards({{1, 2}, {3}}, made);
                     std::erase_if(made.observations.leds,
                                   [](const LedView& view) { return view.sensor == 3 && view.station; });
                   }}),
    [](const auto& of_case) { return of_case.param.name; });

double led_error_mm(const CalibrationState& state, const CalibrationState& truth) {
  double sum = 0;
  for (std::size_t l = 0; l < truth.rig.leds.size(); ++l) {
    sum += (state.rig.leds[l].position_mm - truth.rig.leds[l].position_mm).squaredNorm();
  }
  return std::sqrt(sum / static_cast<double>(truth.rig.leds.size()));
}

TEST(CalibrateSystemStart, EachWayIsNearerToTheTruthThanTheOneBefore) {
  double closed_mm = 0, stages_mm = 0, joint_mm = 0;  // of the LEDs, summed over campaigns
  for (const unsigned seed : {1U, 2U, 3U, 4U, 5U}) {
    const MadeSystem made = make_system({.projector = false, .stations = 15, .seed = seed});
    const CalibrationData data = data_of(made);
    const auto closed = closed_forms(data, kFlat.bundle);
    ASSERT_TRUE(closed) << closed.error().message;
    const auto stages = stage_by_stage(data, kFlat);
    ASSERT_TRUE(stages) << stages.error().message;
    const auto joint = calibrate(data, kFlat);
    ASSERT_TRUE(joint) << joint.error().message;
    closed_mm += led_error_mm(*closed, made.truth);
    stages_mm += led_error_mm(*stages, made.truth);
    joint_mm += led_error_mm(joint->bundle.state, made.truth);
  }
  EXPECT_LT(stages_mm, closed_mm);
  EXPECT_LT(joint_mm, stages_mm);
}

// Trackers that were moved, with too little in common: stations without boards, and three references.
TEST(CalibrateSystemStart, AMovedTrackerThatNothingTiesIsNamed) {
  MadeSystem made = make_system({.projector = false, .stations = 20, .room_leds = 3, .moved_trackers = true});
  std::erase_if(made.observations.corners, [](const CornerView& view) { return view.station >= 10U; });
  const auto found = calibrate(data_of(made), kFlat);
  ASSERT_FALSE(found);
  EXPECT_THAT(found.error().message, HasSubstr("track0b"));
  EXPECT_THAT(found.error().message, HasSubstr("reference LEDs"));
}

// A board printed 0.3 % too large, and a bar that knows better.
TEST(CalibrateSystemStart, AScaleBarCorrectsTheBoards) {
  const MadeSystem made = make_system({.projector = false, .stations = 16, .bar_mm = 1100, .bar_places = 2});
  CalibrationData data = data_of(made);
  for (BoardSpec& board : data.boards) board.target.pitch_mm *= 1.003;
  EXPECT_FALSE(calibrate(data, kFlat)->scale);
  const std::size_t first = made.truth.rig.leds.size() - 4;
  ASSERT_EQ(made.truth.rig.leds[first].name, "bar0a");
  data.bars = {{"bar", {{first, first + 1}, {first + 2, first + 3}}, 1100, {.pitch_sigma_mm = 0.011}, 0}};
  const auto found = calibrate(data, kFlat);
  ASSERT_TRUE(found) << found.error().message;
  ASSERT_TRUE(found->scale);
  EXPECT_GT(found->scale->relative, 1e-5);
  EXPECT_LT(found->scale->relative, 1e-3);
  EXPECT_NEAR(found->bundle.state.boards[0].scale * 1.003, 1, 4 * found->scale->relative);
}

TEST(CalibrateSystemStart, AProbeTurnedAboutOneAxisIsRefusedByName) {
  const MadeSystem made = make_system({.projector = false, .stations = 10, .one_axis = true});
  const auto found = calibrate(data_of(made), kFlat);
  ASSERT_FALSE(found);
  EXPECT_THAT(found.error().message, HasSubstr("hand and eye"));
  EXPECT_THAT(found.error().message, HasSubstr("ax"));
}

TEST(CalibrateSystemStart, AProbeThatIsOnlyShiftedIsRefusedByName) {
  const MadeSystem made = make_system({.projector = false, .stations = 8, .turn_deg = 0});
  const auto found = calibrate(data_of(made), kFlat);
  ASSERT_FALSE(found);
  EXPECT_THAT(found.error().message, HasSubstr("parallel"));
}

TEST(CalibrateSystemStart, AStationThatNothingPosesIsNamed) {
  MadeSystem made = make_system({.projector = false, .stations = 8, .wand_stations = 1});
  auto& leds = made.observations.leds;
  for (LedView& view : leds) {
    if (view.station != 8U) continue;
    view.leds.resize(2);
    view.pixels.resize(2);
  }
  const auto found = calibrate(data_of(made), kFlat);
  ASSERT_FALSE(found);
  EXPECT_THAT(found.error().message, HasSubstr("station_8"));
}

// Led 4 is in the first tracker's view only, and so in no constellation.
TEST(CalibrateSystemStart, AnLedThatOneTrackerSeesIsLocatedFromSeveralStationsOrNamed) {
  MadeSystem made = make_system({.projector = false, .stations = 12});
  bool first = true;
  const auto keep_led_4 = [&](bool once) {
    MadeSystem with = made;
    for (LedView& view : with.observations.leds) {
      if (view.sensor == 1 && !(once && !first)) {
        first = false;
        continue;
      }
      const auto at = std::find(view.leds.begin(), view.leds.end(), std::size_t{4}) - view.leds.begin();
      if (at == static_cast<std::ptrdiff_t>(view.leds.size())) continue;
      view.leds.erase(view.leds.begin() + at);
      view.pixels.erase(view.pixels.begin() + at);
    }
    return with;
  };
  const auto found = calibrate(data_of(keep_led_4(false)), kFlat);
  ASSERT_TRUE(found) << found.error().message;
  EXPECT_LT((found->bundle.state.rig.leds[4].position_mm - made.truth.rig.leds[4].position_mm).norm(), 3);
  first = true;
  const auto named = calibrate(data_of(keep_led_4(true)), kFlat);
  ASSERT_FALSE(named);
  EXPECT_THAT(named.error().message, HasSubstr("LED led4"));
}

TEST(CalibrateSystemStart, ATrackerWithoutBoardsIsNamed) {
  MadeSystem made = make_system({.projector = false, .stations = 8});
  std::erase_if(made.observations.corners, [](const CornerView& view) { return view.sensor == 2; });
  const auto found = calibrate(data_of(made), kFlat);
  ASSERT_FALSE(found);
  EXPECT_THAT(found.error().message, HasSubstr("track1"));
}

// The sum of squares over the noise's variance.
double cost_of(const BundleResult& result, const MadeSystemOptions& options) {
  double cost = 0;
  for (const ViewSummary& view : result.views) {
    const double sigma_px = view.kind == View::Kind::leds ? options.led_sigma_px : options.corner_sigma_px;
    cost += view.residuals_px.squaredNorm() / (sigma_px * sigma_px);
  }
  return cost;
}

TEST(CalibrateSystemStart, TrackersWithBoardsOfTheirOwnReachTheCostOfAStartFromTheTruth) {
  const MadeSystemOptions options{.projector = false, .stations = 16, .tracker_placements = 16};
  MadeSystem made = make_system(options);
  share_out_boards({{1}, {2}}, made);
  const CalibrationOptions all_count{.warp = WarpChoice::off, .bundle = {.reject_outliers = false}};
  const auto found = calibrate(data_of(made), all_count);
  ASSERT_TRUE(found) << found.error().message;
  BundleOptions same = all_count.bundle;
  same.priors = found->priors;
  same.corner_inflation = found->inflation.corners;
  const auto from_truth = refine(made.truth, made.observations, same);
  ASSERT_TRUE(from_truth) << from_truth.error().message;
  EXPECT_NEAR(cost_of(found->bundle, options) / cost_of(*from_truth, options), 1, 1e-4);
  EXPECT_LT(local_step(from_truth->state.rig.sensors[2].sensor_from_mount,
                       found->bundle.state.rig.sensors[2].sensor_from_mount)
                .norm(),
            1e-2);
}

TEST(CalibrateSystemStart, ATrackerThatSharesNeitherBoardsNorLedsIsNamed) {
  MadeSystem made = make_system({.trackers = 3, .projector = false, .stations = 8, .tracker_placements = 16});
  share_out_boards({{1, 2}, {3}}, made);
  std::erase_if(made.observations.leds, [](const LedView& view) { return view.sensor == 3; });
  const auto found = calibrate(data_of(made), kFlat);
  ASSERT_FALSE(found);
  EXPECT_THAT(found.error().message, HasSubstr("track2: no board placement is shared with the other trackers"));
  EXPECT_THAT(found.error().message, HasSubstr("fewer than four points"));
}

TEST(CalibrateSystemStart, ATrackerThatReadsThreeLedsAtOneStationOnlyIsNamed) {
  MadeSystem made = make_system({.trackers = 3, .projector = false, .stations = 8, .tracker_placements = 16});
  share_out_boards({{1, 2}, {3}}, made);
  std::erase_if(made.observations.leds, [](const LedView& view) { return view.sensor == 3 && view.station != 0U; });
  for (LedView& view : made.observations.leds) {
    if (view.sensor != 3) continue;
    ASSERT_GT(view.leds.size(), 3U);
    view.leds.resize(3);
    view.pixels.resize(3);
  }
  const auto found = calibrate(data_of(made), kFlat);
  ASSERT_FALSE(found);
  EXPECT_THAT(found.error().message, HasSubstr("track2"));
  EXPECT_THAT(found.error().message, HasSubstr("fewer than four points"));
}

// Neither boards nor a second tracker that is joined tell how far away LEDs are.
TEST(CalibrateSystemStart, TrackersWithBoardsOfTheirOwnAndNoOtherCameraAreRefusedByName) {
  MadeSystem made = make_system({.projector = false, .stations = 8, .tracker_placements = 16});
  share_out_boards({{1}, {2}}, made);
  CalibrationData data = data_of(made);
  data.sensors.erase(data.sensors.begin());
  std::erase_if(data.observations.corners, [](const CornerView& view) { return view.sensor == 0; });
  for (CornerView& view : data.observations.corners) --view.sensor;
  for (LedView& view : data.observations.leds) --view.sensor;
  const auto found = calibrate(data, kFlat);
  ASSERT_FALSE(found);
  EXPECT_THAT(found.error().message, HasSubstr("track1: no board placement"));
  EXPECT_THAT(found.error().message, HasSubstr("no camera on the probe sees a board"));
}

// Stations in the order of their placements, and every tracker sees every board: what the probe looks at too.
void see_boards_one_after_the_other(MadeSystem& made, std::size_t placements) {
  const std::size_t count = made.truth.world_from_probe.size();
  std::vector<std::size_t> moved_to(count);
  std::vector<Pose> world_from_probe;
  for (std::size_t p = 0; p < placements; ++p) {
    for (std::size_t s = p; s < count; s += placements) {
      moved_to[s] = world_from_probe.size();
      world_from_probe.push_back(made.truth.world_from_probe[s]);
    }
  }
  made.truth.world_from_probe = std::move(world_from_probe);
  const auto renumber = [&](auto& views) {
    for (auto& view : views) {
      if (view.station) view.station = moved_to[*view.station];
    }
  };
  renumber(made.observations.corners);
  renumber(made.observations.leds);
  const std::vector<CornerView> corners = made.observations.corners;
  for (const CornerView& view : corners) {
    if (!view.station) continue;
    for (std::size_t s = 0; s < made.truth.rig.sensors.size(); ++s) {
      if (made.truth.rig.sensors[s].mount != Mount::world) continue;
      made.observations.corners.push_back({s, view.placement, view.corners, view.pixels, std::nullopt});
    }
  }
}

// What a sensor sees from a station on, and of placements that the probe saw from then on alone, is what it sees from
// another place. With noise; `made` has none.
void knock(MadeSystem& made, std::size_t sensor, const Vector6d& step, std::size_t first_station) {
  std::set<std::size_t> late;
  for (const CornerView& view : made.observations.corners) {
    if (view.station && *view.station >= first_station) late.insert(view.placement);
  }
  for (const CornerView& view : made.observations.corners) {
    if (view.station && *view.station < first_station) late.erase(view.placement);
  }
  CalibrationState knocked = made.truth;
  Pose& place = knocked.rig.sensors[sensor].sensor_from_mount;
  place = retract(place, step);
  const Observations after = predicted_observations(knocked, made.observations);
  made.observations = predicted_observations(made.truth, made.observations);
  for (std::size_t v = 0; v < after.leds.size(); ++v) {
    if (after.leds[v].station && *after.leds[v].station >= first_station) made.observations.leds[v] = after.leds[v];
  }
  for (std::size_t v = 0; v < after.corners.size(); ++v) {
    const CornerView& view = after.corners[v];
    if (view.station ? *view.station >= first_station : late.contains(view.placement)) {
      made.observations.corners[v] = view;
    }
  }
  std::mt19937_64 random(3);
  add_noise({0.1, 0.1, 0, 0.05}, random, made.observations);
}

MadeSystemOptions quiet(MadeSystemOptions options) {
  options.projector = false;
  options.led_sigma_px = options.corner_sigma_px = 0;
  return options;
}

const Vector6d kKnock = (Vector6d() << 1.5e-3, -4e-3, 0.5e-3, 4, 1, 3).finished();
const Vector6d kNudge = (Vector6d() << 1.5e-3, -1e-3, 0.5e-3, 0.8, 0.5, 0).finished();

TEST(MovedSensor, IsNamedWithTheStationFromWhichOnItStandsElsewhere) {
  MadeSystem made = make_system(quiet({.trackers = 3, .stations = 20}));
  knock(made, 2, kNudge, 11);
  const auto found = calibrate(data_of(made), kFlat);
  ASSERT_TRUE(found) << found.error().message;
  EXPECT_FALSE(judge(*found).ok);
  const auto moved = find_moved_sensor(data_of(made), *found, 1);
  ASSERT_TRUE(moved);
  EXPECT_EQ(moved->sensor, 2u);
  EXPECT_EQ(moved->first_station, 11u);
  EXPECT_THAT(moved->or_else, IsEmpty());
  EXPECT_LT((moved->step - kNudge).head<3>().norm(), 3e-4);
  EXPECT_THAT(moved->sentence, HasSubstr("track1"));
  EXPECT_THAT(moved->sentence, HasSubstr("station_11"));
}

// After the push probe and trackers go on looking at boards, which stand where none did before.
TEST(MovedSensor, IsNamedOfThreeTrackersThatSeeBoardsAfterwards) {
  MadeSystem made = make_system(quiet({.trackers = 3, .stations = 10, .placements = 2, .tracker_placements = 8}));
  see_boards_one_after_the_other(made, 2);
  knock(made, 2, kKnock, 5);
  const CalibrationData data = data_of(made);
  const auto found = calibrate(data, kFlat);
  ASSERT_TRUE(found) << found.error().message;
  const auto moved = find_moved_sensor(data, *found, 1);
  ASSERT_TRUE(moved);
  EXPECT_EQ(moved->sensor, 2u);
  EXPECT_EQ(moved->first_station, 5u);
  EXPECT_THAT(moved->or_else, IsEmpty());
  EXPECT_LT((moved->step - kKnock).head<3>().norm(), 3e-4);
  EXPECT_LT((moved->step - kKnock).tail<3>().norm(), 1);
  EXPECT_THAT(moved->sentence, HasSubstr("track1 stood elsewhere from station station_5 on"));
}

// Two trackers that moved against each other between stations 4 and 5; of the LEDs the second one, which was pushed,
// reads from then on those at `read_later` alone.
MadeSystem knocked_reading(const std::set<std::size_t>& read_later) {
  MadeSystem made = make_system(quiet({.trackers = 2, .stations = 10, .placements = 2, .tracker_placements = 8}));
  see_boards_one_after_the_other(made, 2);
  knock(made, 2, kKnock, 5);
  std::erase_if(made.observations.leds, [&](const LedView& view) {
    return view.sensor == 2 && view.station && *view.station >= 5 && !read_later.contains(*view.station);
  });
  return made;
}

// Nothing that stood still was seen both before and after: the two moved against each other.
TEST(MovedSensor, IsOneOrTheOtherOfTwoTrackers) {
  const CalibrationData data = data_of(knocked_reading({5, 6, 7, 8, 9}));
  const auto found = calibrate(data, kFlat);
  ASSERT_TRUE(found) << found.error().message;
  const auto moved = find_moved_sensor(data, *found, 1);
  ASSERT_TRUE(moved);
  EXPECT_EQ(moved->first_station, 5u);
  std::vector<std::size_t> either = moved->or_else;
  either.push_back(moved->sensor);
  EXPECT_THAT(either, UnorderedElementsAre(1u, 2u));
  const std::vector<std::string> reasons = judge(data, *found, 1).reasons;
  EXPECT_THAT(reasons.front(), AllOf(HasSubstr("either track"), HasSubstr("track0 stood elsewhere from station "),
                                     HasSubstr("track1 stood elsewhere from station ")));
  EXPECT_THAT(reasons, Each(Not(HasSubstr("cam0 was moved"))));
}

TEST(MovedSensor, IsOneOrTheOtherThoughOneReadNothingAtThatStation) {
  const CalibrationData data = data_of(knocked_reading({6, 7, 8, 9}));
  const auto found = calibrate(data, kFlat);
  ASSERT_TRUE(found) << found.error().message;
  const auto moved = find_moved_sensor(data, *found, 1);
  ASSERT_TRUE(moved);
  std::vector<std::size_t> either = moved->or_else;
  either.push_back(moved->sensor);
  EXPECT_THAT(either, UnorderedElementsAre(1u, 2u));
}

TEST(MovedSensor, MayBeOneThatReadTooFewStationsToTell) {
  const CalibrationData data = data_of(knocked_reading({8, 9}));
  const auto found = calibrate(data, kFlat);
  ASSERT_TRUE(found) << found.error().message;
  const auto moved = find_moved_sensor(data, *found, 1);
  ASSERT_TRUE(moved);
  EXPECT_EQ(moved->sensor, 1u);
  EXPECT_THAT(moved->or_else, ElementsAre(2u));
  EXPECT_THAT(moved->sentence, AllOf(HasSubstr("either track0 stood elsewhere from station station_5 on"),
                                     HasSubstr("or track1 stood elsewhere from station station_5 on (it read")));
}

// The third tracker reads from two stations after the push, and what it reads fits the first.
TEST(MovedSensor, IsNotOneOfFewStationsThatExplainsLess) {
  MadeSystem made = make_system(quiet({.trackers = 3, .stations = 14}));
  knock(made, 2, kNudge, 7);
  std::erase_if(made.observations.leds,
                [](const LedView& view) { return view.sensor == 3 && view.station && *view.station >= 9; });
  const CalibrationData data = data_of(made);
  const auto found = calibrate(data, kFlat);
  ASSERT_TRUE(found) << found.error().message;
  const auto moved = find_moved_sensor(data, *found, 1);
  ASSERT_TRUE(moved);
  EXPECT_EQ(moved->sensor, 2u);
  EXPECT_THAT(moved->or_else, IsEmpty());
}

// A reflection 30 px off in another tracker has a larger square than all that the push costs.
TEST(MovedSensor, IsNamedBesideAMisreadLed) {
  MadeSystem made = make_system(quiet({.trackers = 3, .stations = 14}));
  knock(made, 2, kNudge, 7);
  const auto misread = std::find_if(made.observations.leds.begin(), made.observations.leds.end(),
                                    [](const LedView& view) { return view.sensor == 3 && view.station == 3U; });
  ASSERT_NE(misread, made.observations.leds.end());
  misread->pixels[0].x() += 30;
  const CalibrationData data = data_of(made);
  const auto found = calibrate(data, kFlat);
  ASSERT_TRUE(found) << found.error().message;
  const auto moved = find_moved_sensor(data, *found, 1);
  ASSERT_TRUE(moved);
  EXPECT_EQ(moved->sensor, 2u);
  EXPECT_EQ(moved->first_station, 7u);
  EXPECT_THAT(moved->or_else, IsEmpty());
  EXPECT_LT((moved->step - kNudge).head<3>().norm(), 3e-4);
}

// The bar's two LEDs, seen nobody knows when, do not tell where a tracker stood, and no board does.
TEST(MovedSensor, IsNamedWhereABarIsAllThatTrackersShareBesideTheProbe) {
  MadeSystem made = make_system(quiet({.trackers = 2, .stations = 14, .tracker_placements = 16, .bar_mm = 1100}));
  share_out_boards({{1}, {2}}, made);
  knock(made, 2, kNudge, 7);
  const CalibrationData data = data_of(made);
  const auto found = calibrate(data, kFlat);
  ASSERT_TRUE(found) << found.error().message;
  const auto moved = find_moved_sensor(data, *found, 1);
  ASSERT_TRUE(moved);
  EXPECT_EQ(moved->sensor, 2u);
  EXPECT_EQ(moved->first_station, 7u);
  EXPECT_THAT(moved->or_else, IsEmpty());
}

// From station 8 on the probe is only shifted; so a tracker that was shifted looks like a camera that came loose.
TEST(MovedSensor, IsATrackerOrACameraOfTheProbe) {
  MadeSystem made = make_system(quiet({.trackers = 1, .leds = 6, .stations = 9}));
  const Observations seen = made.observations;
  const auto see_again = [](const auto& views, std::size_t station, auto& all) {
    for (auto view : views) {
      if (view.station != 8U) continue;
      view.station = station;
      all.push_back(view);
    }
  };
  for (int i = 1; i < 8; ++i) {
    Pose shifted = made.truth.world_from_probe[8];
    shifted.translation += Eigen::Vector3d(6 * i, 20 * (i % 2), -10 * (i % 3));
    see_again(seen.corners, made.truth.world_from_probe.size(), made.observations.corners);
    see_again(seen.leds, made.truth.world_from_probe.size(), made.observations.leds);
    made.truth.world_from_probe.push_back(shifted);
  }
  Vector6d shift;
  shift << 0, 0, 0, 4, 1, 3;
  knock(made, 1, shift, 8);
  const CalibrationData data = data_of(made);
  const auto found = calibrate(data, kFlat);
  ASSERT_TRUE(found) << found.error().message;
  const auto moved = find_moved_sensor(data, *found, 1);
  ASSERT_TRUE(moved);
  EXPECT_EQ(moved->sensor, 1u);
  EXPECT_THAT(moved->or_else, ElementsAre(0u));
  EXPECT_THAT(moved->sentence, AllOf(HasSubstr("either track0 stood elsewhere from station station_8 on"),
                                     HasSubstr("or cam0 came loose from the LEDs from station station_8 on"),
                                     HasSubstr("list the tracker that was moved in capture.yaml"),
                                     HasSubstr("came loose: fasten it and take the campaign again")));
}

// One that the probe still saw where it had been tells which.
TEST(MovedSensor, IsNamedOfTwoTrackersByABoardThatStoodStill) {
  MadeSystem made = make_system(quiet({.trackers = 2, .stations = 12, .tracker_placements = 8}));
  knock(made, 1, kKnock, 6);
  const auto found = calibrate(data_of(made), kFlat);
  ASSERT_TRUE(found) << found.error().message;
  const auto moved = find_moved_sensor(data_of(made), *found, 1);
  ASSERT_TRUE(moved);
  EXPECT_EQ(moved->sensor, 1u);
  EXPECT_THAT(moved->or_else, IsEmpty());
}

// It came loose from the LEDs; the tracker is not to blame.
TEST(MovedSensor, NoneWasWhereTheProbesCameraWas) {
  MadeSystem made = make_system(quiet({.trackers = 1, .leds = 6, .stations = 16}));
  knock(made, 0, kKnock, 8);
  const CalibrationData data = data_of(made);
  const auto found = calibrate(data, kFlat);
  ASSERT_TRUE(found) << found.error().message;
  EXPECT_FALSE(find_moved_sensor(data, *found, 1));
  EXPECT_THAT(judge(data, *found, 1).reasons, Contains(HasSubstr("cam0 was moved")));
}

TEST(MovedSensor, NoneWasWhereNothingHappened) {
  const MadeSystem made = make_system({.trackers = 3, .projector = false, .stations = 16});
  const auto found = calibrate(data_of(made), kFlat);
  ASSERT_TRUE(found) << found.error().message;
  EXPECT_FALSE(find_moved_sensor(data_of(made), *found, 1));
}

}  // namespace
}  // namespace crumple
