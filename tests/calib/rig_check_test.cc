// Earlier rigs: as the start and prior of a calibration, and held against new observations.
#include "calib/rig_check.h"

#include <cmath>
#include <numeric>
#include <random>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "calib/uncertainty_budget.h"
#include "calib/verdict.h"
#include "solvers/rig_covariance.h"
#include "tests/calib/made_system_data.h"
#include "tests/solvers/noisy_observations.h"

namespace crumple {
namespace {

using testing::HasSubstr;

const CalibrationOptions kFlatBoards{.warp = WarpChoice::off};
constexpr MadeSystemOptions kCampaign{.trackers = 3, .projector = false, .stations = 20};

// A rig of the made campaigns as it was calibrated once.
const Calibration& earlier() {
  static const Calibration calibration = calibrate(data_of(make_system(kCampaign)), kFlatBoards).value();
  return calibration;
}

EarlierRig earlier_rig() { return {.rig = calibrated_rig(earlier())}; }

// A few stations before the same rig, which may have changed since.
CalibrationData interim(unsigned seed, void (*change)(Rig&)) {
  MadeSystemOptions options = kCampaign;
  options.stations = 5;
  options.tracker_placements = 1;
  options.seed = seed;
  options.change = change;
  return data_of(make_system(options));
}

TEST(StartFromRig, ContinuesWithTheRigsKnowledge) {
  MadeSystemOptions few = kCampaign;
  few.stations = 6;
  few.tracker_placements = 2;
  few.seed = 2;
  const MadeSystem made = make_system(few);
  CalibrationOptions options = kFlatBoards;
  options.earlier = earlier_rig();
  const auto continued = calibrate(data_of(made), options);
  ASSERT_TRUE(continued) << continued.error().message;
  // Better known than before, and still true.
  const Rig now = calibrated_rig(*continued);
  for (std::size_t i = 0; i < now.covariance.names.size(); ++i) {
    const auto& names = options.earlier->rig.covariance.names;
    const auto row = std::find(names.begin(), names.end(), now.covariance.names[i]) - names.begin();
    const bool of_other_boards = now.covariance.names[i].find(".datum_") != std::string::npos;
    if (of_other_boards || row == static_cast<std::ptrdiff_t>(names.size())) continue;
    EXPECT_LE(now.covariance.matrix(i, i), options.earlier->rig.covariance.matrix(row, row) * (1 + 1e-9))
        << now.covariance.names[i];
  }
  for (std::size_t l = 0; l < now.leds.size(); ++l) {
    EXPECT_LT((now.leds[l].position_mm - made.truth.rig.leds[l].position_mm).norm(), 1) << l;
  }
}

// Cameras first, then the rest with the first result as a prior: the same as all at once, as far as sigmas that are
// estimated from the parts allow.
TEST(StartFromRig, TwoStepsGiveWhatOneGives) {
  const MadeSystem made = make_system(kCampaign);
  CalibrationData first = data_of(made), second = data_of(made);
  const auto late = [](const auto& view) { return view.station && *view.station >= 10; };
  std::erase_if(first.observations.corners,
                [&](const CornerView& v) { return late(v) || (!v.station && v.placement % 2); });
  std::erase_if(first.observations.leds, late);
  std::erase_if(second.observations.corners,
                [&](const CornerView& v) { return v.station ? !late(v) : v.placement % 2 == 0; });
  std::erase_if(second.observations.leds, [&](const LedView& v) { return !late(v); });
  for (CalibrationData* part : {&first, &second}) {
    // Placements and stations that a part does not see would be asked for.
    CalibrationData kept = *part;
    kept.observations.corners.clear();
    kept.observations.leds.clear();
    kept.placement_names.clear();
    kept.board_of.clear();
    kept.station_names.clear();
    std::map<std::size_t, std::size_t> placement, station;
    const auto number = [](std::size_t old, std::map<std::size_t, std::size_t>& numbers) {
      return numbers.emplace(old, numbers.size()).first->second;
    };
    for (CornerView view : part->observations.corners) {
      const std::size_t old = view.placement;
      view.placement = number(old, placement);
      if (view.placement == kept.placement_names.size()) {
        kept.placement_names.push_back(part->placement_names[old]);
        kept.board_of.push_back(part->board_of[old]);
      }
      if (view.station) {
        const std::size_t at = *view.station;
        view.station = number(at, station);
        if (*view.station == kept.station_names.size()) kept.station_names.push_back(part->station_names[at]);
      }
      kept.observations.corners.push_back(std::move(view));
    }
    for (LedView view : part->observations.leds) {
      if (!station.contains(*view.station)) continue;
      view.station = station.at(*view.station);
      kept.observations.leds.push_back(std::move(view));
    }
    kept.observations.placement_count = kept.placement_names.size();
    *part = std::move(kept);
  }
  const auto once = calibrate(data_of(made), kFlatBoards);
  const auto step = calibrate(first, kFlatBoards);
  ASSERT_TRUE(once && step);
  CalibrationOptions options = kFlatBoards;
  options.earlier = EarlierRig{.rig = calibrated_rig(*step)};
  const auto twice = calibrate(second, options);
  ASSERT_TRUE(twice) << twice.error().message;
  const Rig a = calibrated_rig(*once), b = calibrated_rig(*twice);
  ASSERT_EQ(a.covariance.names, b.covariance.names);
  // The board before the probe is another placement to each step, which the steps do not know to be one.
  for (std::size_t l = 0; l < a.leds.size(); ++l) {
    const auto row = std::find(a.covariance.names.begin(), a.covariance.names.end(), a.leds[l].name + ".x") -
                     a.covariance.names.begin();
    for (Eigen::Index k = 0; k < 3; ++k) {
      const double sigma = std::sqrt(a.covariance.matrix(row + k, row + k));
      EXPECT_NEAR(a.leds[l].position_mm[k], b.leds[l].position_mm[k], 0.5 * sigma);
      EXPECT_NEAR(std::sqrt(b.covariance.matrix(row + k, row + k)) / sigma, 1, 0.15);
    }
  }
}

// LEDs alone: neither the probe's camera and projector nor a board is seen, and all of them stay as well known as they
// were, the scale among it.
TEST(StartFromRig, WhatIsNotSeenAgainStaysKnown) {
  constexpr MadeSystemOptions kProbe{.trackers = 3, .stations = 10};
  CalibrationData first = data_of(make_system(kProbe));
  for (BoardSpec& board : first.boards) board.certificate = BoardCertificate{.pitch_sigma_mm = 0.003};
  const auto earlier = calibrate(first, kFlatBoards);
  ASSERT_TRUE(earlier) << earlier.error().message;
  MadeSystemOptions wand = kProbe;
  wand.stations = wand.tracker_placements = 0;
  wand.wand_stations = 8;
  wand.seed = 2;
  CalibrationData leds = data_of(make_system(wand));
  leds.observations.placement_count = 0;
  leds.placement_names.clear();
  leds.board_of.clear();
  CalibrationOptions options = kFlatBoards;
  options.earlier = EarlierRig{.rig = calibrated_rig(*earlier)};
  const auto found = calibrate(leds, options);
  ASSERT_TRUE(found) << found.error().message;
  const RigCovariance before = options.earlier->rig.covariance, after = calibrated_rig(*found).covariance;
  EXPECT_THAT(after.names, testing::IsSupersetOf({"cam0.fx", "proj0.fx", "proj0.translation_x", "board.scale"}));
  for (std::size_t i = 0; i < after.names.size(); ++i) {
    if (after.names[i].find(".datum_") != std::string::npos) continue;  // of these observations
    const auto row = std::find(before.names.begin(), before.names.end(), after.names[i]) - before.names.begin();
    ASSERT_LT(row, static_cast<std::ptrdiff_t>(before.names.size())) << after.names[i];
    const auto at = static_cast<Eigen::Index>(i);
    EXPECT_LE(after.matrix(at, at), before.matrix(row, row) * (1 + 1e-6)) << after.names[i];
    EXPECT_GT(after.matrix(at, at), 0) << after.names[i];
  }
  // By which a later check tells whether they changed.
  EXPECT_TRUE(calibrated_rig(*found).sigma_px.contains("cam0.corners"));
  const Verdict verdict = judge(leds, *found, 1);
  EXPECT_THAT(verdict.notes, testing::Contains(HasSubstr("nothing was observed by cam0, proj0: the earlier rig's")));
  EXPECT_THAT(verdict.notes, testing::Not(testing::Contains(HasSubstr("scale's uncertainty is unknown"))));
  EXPECT_THAT(verdict.notes,
              testing::Contains(HasSubstr("uncertainty is not complete: the thermal expansion of board")));
  EXPECT_EQ(calibrated_rig(*found).scale_lacks, options.earlier->rig.scale_lacks);
  EXPECT_THAT(verdict.notes, testing::Not(testing::Contains(HasSubstr("extrapolated"))));
  EXPECT_THAT(verdict.reasons, testing::IsEmpty());
}

// The certificate of a board whose size the rig knows was counted with it, and so was what that lacks.
TEST(StartFromRig, WhatTheRigsScaleLacksStaysMissing) {
  CalibrationData data = interim(3, nullptr);
  for (BoardSpec& board : data.boards) {
    board.certificate =
        BoardCertificate{.pitch_sigma_mm = 0.003, .expansion_per_k = 1e-5, .expansion_sigma_per_k = 1e-6};
  }
  CalibrationOptions options = kFlatBoards;
  options.earlier = earlier_rig();  // whose scale is not known
  const auto certified = calibrate(data, options);
  ASSERT_TRUE(certified) << certified.error().message;
  Rig known = calibrated_rig(*certified);
  EXPECT_THAT(known.scale_lacks, testing::ElementsAre("the temperature during the calibration is not stated"));
  known.scale_lacks = {"a part that is the rig's"};
  options.earlier = EarlierRig{.rig = known};
  const auto again = calibrate(data, options);
  ASSERT_TRUE(again) << again.error().message;
  EXPECT_THAT(calibrated_rig(*again).scale_lacks, testing::ElementsAre("a part that is the rig's"));
}

TEST(StartFromRig, HoldsWhatIsNotToBeCorrected) {
  CalibrationOptions options = kFlatBoards;
  options.earlier = earlier_rig();
  options.earlier->corrected = {"track1"};
  const auto found = calibrate(interim(3, nullptr), options);
  ASSERT_TRUE(found) << found.error().message;
  const Rig& rig = found->bundle.state.rig;
  EXPECT_EQ(rig.sensors[0].lens.parameters(), options.earlier->rig.sensors[0].lens.parameters());
  EXPECT_NE(rig.sensors[2].lens.parameters(), options.earlier->rig.sensors[2].lens.parameters());
  EXPECT_EQ(rig.leds[0].position_mm, options.earlier->rig.leds[0].position_mm);
}

// One step of the rig along a tangent by the names of the covariance's rows.
Rig stepped(Rig rig, const Eigen::VectorXd& step) {
  const CalibrationState named{rig, {}, {}, {}};
  CalibrationState state = named;
  for (std::size_t s = 0; s < rig.sensors.size(); ++s) {
    for (const BlockId& block : {BlockId{BlockId::Kind::lens, s}, BlockId{BlockId::Kind::mount, s}}) {
      const auto row = find_row(rig.covariance, parameter_names(block, named).front());
      if (row) move_block(block, step.segment(*row, tangent_size(block, named)), state);
    }
  }
  for (std::size_t l = 0; l < rig.leds.size(); ++l) {
    const BlockId block{BlockId::Kind::led, l};
    if (const auto row = find_row(rig.covariance, rig.leds[l].name + ".x")) {
      move_block(block, step.segment<3>(*row), state);
    }
  }
  rig.sensors = state.rig.sensors;
  rig.leds = state.rig.leds;
  return rig;
}

// What is kept is off by what the earlier rig's covariance says, what is corrected beside it follows: both are in the
// covariance, and what is kept stays as uncertain as it was.
TEST(StartFromRig, WhatIsKeptIsAsUncertainAsItWasAndMakesTheRestSo) {
  constexpr int kCampaigns = 16;
  const Rig before = calibrated_rig(earlier());
  Rig truth = make_system(kCampaign).truth.rig;
  truth.covariance = before.covariance;
  Eigen::Index rows = 0;
  while (rows < before.covariance.matrix.rows() &&
         before.covariance.names[static_cast<std::size_t>(rows)].find(".datum_") == std::string::npos) {
    ++rows;
  }
  const Eigen::MatrixXd root = before.covariance.matrix.topLeftCorner(rows, rows).llt().matrixL();
  std::mt19937_64 random(20261128);
  std::normal_distribution<double> normal(0, 1);
  double squares = 0, alone = 0, degrees = 0;
  for (unsigned seed = 1; seed <= kCampaigns; ++seed) {
    Eigen::VectorXd step(root.rows());
    for (double& z : step) z = normal(random);
    CalibrationOptions options = kFlatBoards;
    options.earlier = EarlierRig{.rig = stepped(truth, root * step)};
    options.earlier->corrected = {"track1"};
    const auto found = calibrate(interim(100 + seed, nullptr), options);
    ASSERT_TRUE(found) << found.error().message;
    const JointCovariance& whole = whole_covariance(*found);
    const auto size = static_cast<Eigen::Index>(whole.rig_rows());
    Eigen::VectorXd off(size);
    Eigen::Index row = 0;
    for (const BlockId& block : whole.parameters().common_blocks()) {
      if (block.is_pose()) continue;
      const CalibrationState true_state{truth, {}, {}, {}};
      const Eigen::VectorXd part = block_step(block, true_state, found->bundle.state);
      off.segment(row, part.size()) = part;
      row += part.size();
    }
    ASSERT_EQ(row, size);
    squares += off.dot(whole.common().topLeftCorner(size, size).llt().solve(off));
    degrees += static_cast<double>(size);
    if (seed == 1) {
      const UncertaintyBudget budget = uncertainty_budget(interim(100 + seed, nullptr).observations, *found, 1);
      ASSERT_EQ(budget.entries.size(), static_cast<std::size_t>(size));
      for (std::size_t i = 0; i < budget.entries.size(); ++i) {
        const BudgetEntry& entry = budget.entries[i];
        EXPECT_EQ(entry.name, whole.names()[i]);
        EXPECT_NEAR(std::accumulate(entry.shares.begin(), entry.shares.end(), 0.0), 1, 1e-9) << entry.name;
        EXPECT_GE(entry.shares.back(), -1e-6) << entry.name;
        const bool is_corrected = entry.part == "lens of track1" || entry.part == "mount of track1";
        EXPECT_EQ(entry.shares.back() < 1 - 1e-9, is_corrected) << entry.name << entry.shares.back();
      }
    }
    const BlockId lens{BlockId::Kind::lens, 0};
    EXPECT_NEAR(whole.of({lens}, found->bundle.state)(0, 0) / before.covariance.matrix(0, 0), 1, 1e-6);
    // Of what is corrected the observations alone say too little.
    const BlockId mount{BlockId::Kind::mount, 2};
    const Eigen::VectorXd of_mount = block_step(mount, {truth, {}, {}, {}}, found->bundle.state);
    alone += of_mount.dot(found->bundle.covariance.of({mount}, found->bundle.state).llt().solve(of_mount)) / 6;
  }
  EXPECT_NEAR(squares / degrees, 1, 4 * std::sqrt(2 / degrees));
  EXPECT_GT(alone / kCampaigns, 1.5);
}

TEST(StartFromRig, RefusesWhatIsAnotherProbe) {
  CalibrationOptions options = kFlatBoards;
  options.earlier = earlier_rig();
  options.earlier->rig.sensors[0].name = "cam7";
  const auto stranger = calibrate(interim(3, nullptr), options);
  ASSERT_FALSE(stranger);
  EXPECT_THAT(stranger.error().message, HasSubstr("cam0"));
  // Of the same names, but with the LEDs of another.
  options.earlier = earlier_rig();
  for (Led& led : options.earlier->rig.leds)
    led.position_mm = Eigen::Vector3d(led.position_mm.y(), 30, led.position_mm.x());
  const auto other = calibrate(interim(3, nullptr), options);
  if (other) {
    const Verdict verdict = judge(*other);
    EXPECT_FALSE(verdict.ok);
    EXPECT_THAT(testing::PrintToString(verdict.reasons), HasSubstr("earlier rig"));
  }
}

TEST(RigCheck, FindsNothingWhereNothingChanged) {
  int alarms = 0;
  for (unsigned seed = 10; seed < 16; ++seed) {
    const auto check = check_rig(interim(seed, nullptr), earlier_rig(), 1);
    ASSERT_TRUE(check) << check.error().message;
    EXPECT_GT(check->parts.size(), 10u);
    alarms += check->valid() ? 0 : 1;
    EXPECT_NEAR(check->square_sum / check->redundancy, 1, 0.3);
  }
  EXPECT_EQ(alarms, 0);
}

std::string all_named(const RigCheck& check) {
  std::string names;
  for (const PartChange& change : check.changed)
    names += check.parts[change.part].name + " by " + check.parts[change.part].how_far + "; ";
  return names;
}

// A scale bar lies elsewhere each time: that is no change of the rig.
CalibrationData with_bar(const MadeSystem& made) {
  CalibrationData data = data_of(made);
  const std::size_t end = made.truth.rig.leds.size() - 1;
  for (std::size_t l = 0; l < end; ++l) {
    if (made.truth.rig.leds[l].name == "bar0a") {
      data.bars = {{"bar", {{l, l + 1}}, 900, {.pitch_sigma_mm = 0.05}, 0}};
    }
  }
  return data;
}

TEST(RigCheck, ABarPutDownElsewhereIsNoChange) {
  MadeSystemOptions options = kCampaign;
  options.bar_mm = 900;
  const EarlierRig known{.rig = calibrated_rig(calibrate(with_bar(make_system(options)), kFlatBoards).value())};
  options.stations = 5;
  options.tracker_placements = 1;
  options.seed = 31;
  const MadeSystem later = make_system(options);
  const auto check = check_rig(with_bar(later), known, 1);
  ASSERT_TRUE(check) << check.error().message;
  EXPECT_TRUE(check->valid()) << check->parts[check->changed[0].part].name;
}

// A bar's two ends, seen nobody knows when, do not tell from where; boards shown to the trackers alone do.
TEST(RigCheck, NamesATrackerMovedMeanwhileBesideWhatWasSeenNobodyKnowsWhen) {
  MadeSystemOptions options = kCampaign;
  options.bar_mm = 900;
  const EarlierRig known{.rig = calibrated_rig(calibrate(with_bar(make_system(options)), kFlatBoards).value())};
  options.stations = 4;
  for (const int boards : {0, 1}) {
    options.tracker_placements = boards;
    options.seed = 41;
    CalibrationData data = with_bar(make_system(options));
    options.change = [](Rig& rig) {
      Pose& pose = rig.sensors[*rig.find("track1")].sensor_from_mount;
      pose = retract(pose, (Vector6d() << 0, 2e-3, 0, 0, 0, 0).finished());
    };
    const CalibrationData later = with_bar(make_system(options));
    options.change = nullptr;
    for (std::size_t v = 0; v < data.observations.leds.size(); ++v) {
      LedView& view = data.observations.leds[v];
      if (view.station && *view.station >= 2) view = later.observations.leds[v];
    }
    const auto check = check_rig(data, known, 1);
    ASSERT_TRUE(check) << check.error().message;
    ASSERT_TRUE(check->moved) << boards;
    EXPECT_EQ(check->moved->trackers, std::vector<std::string>{"track1"}) << check->moved->what;
    EXPECT_EQ(check->moved->first_station, 2U) << check->moved->what;
  }
}

const PartCheck& part_named(const RigCheck& check, const std::string& name) {
  return *std::find_if(check.parts.begin(), check.parts.end(), [&](const PartCheck& p) { return p.name == name; });
}

// Of a change in the direction where it shows least, four in five are found, and smaller ones are not.
TEST(RigCheck, SaysFromHowMuchOnAChangeWouldShow) {
  const RigCheck sound = check_rig(interim(40, nullptr), earlier_rig(), 1).value();
  const double shift_mm = part_named(sound, "LED led3").would_show_mm.value();
  EXPECT_GT(shift_mm, 0.01);
  EXPECT_LT(shift_mm, 1);
  EXPECT_FALSE(part_named(sound, "LED led3").would_show_deg);
  EXPECT_GT(part_named(sound, "the place of track1").would_show_deg.value(), 1e-4);
  EXPECT_FALSE(part_named(sound, "the lens of track1").would_show_mm);
  int found = 0, by_chance = 0;
  constexpr int kDraws = 4;
  for (unsigned seed = 40; seed < 40 + kDraws; ++seed) {
    const auto moved_by = [&](double share) {
      EarlierRig before = earlier_rig();
      before.rig.leds[3].position_mm.z() -= share * shift_mm;
      return check_rig(interim(seed, nullptr), before, 1).value();
    };
    found += part_named(moved_by(1.5), "LED led3").probability < 1e-4 ? 1 : 0;
    by_chance += moved_by(0.2).valid() ? 0 : 1;
  }
  EXPECT_GE(found, kDraws - 1);
  EXPECT_LE(by_chance, 1);
}

// One stripe reading in fifty is decoded wrongly; the projector was nudged.
TEST(RigCheck, DecodingErrorsHideNoChange) {
  MadeSystemOptions options = kCampaign;
  options.projector = true;
  const EarlierRig known{.rig = calibrated_rig(calibrate(data_of(make_system(options)), kFlatBoards).value())};
  options.stations = 5;
  options.tracker_placements = 1;
  options.seed = 51;
  const auto seen = [&](void (*change)(Rig&)) {
    options.change = change;
    MadeSystem made = make_system(options);
    std::mt19937_64 random(6);
    const NoiseLevels stripes_only{.stripe_px = options.stripe_sigma_px};
    Observations wrong = made.observations;
    add_gross_errors(0.02, stripes_only, random, wrong);
    made.observations.stripes = wrong.stripes;
    return check_rig(data_of(made), known, 1).value();
  };
  const RigCheck sound = seen(nullptr);
  EXPECT_TRUE(sound.valid()) << all_named(sound);
  EXPECT_NEAR(sound.square_sum / sound.redundancy, 1, 0.2);
  const RigCheck nudged = seen([](Rig& rig) { rig.sensors[1].sensor_from_mount.translation.y() += 0.3; });
  ASSERT_EQ(nudged.changed.size(), 1u) << all_named(nudged);
  // Of five stations: it, or that the camera was nudged before projector and LEDs.
  const PartChange& change = nudged.changed[0];
  std::vector<std::string> names{nudged.parts[change.part].name};
  for (const std::size_t other : change.or_else) names.push_back(nudged.parts[other].name);
  EXPECT_THAT(names, testing::UnorderedElementsAre("the place of cam0", "the place of proj0"));
}

TEST(RigCheck, NamesTheTrackerThatWasNudged) {
  const auto check = check_rig(interim(21,
                                       [](Rig& rig) {
                                         Pose& pose = rig.sensors[2].sensor_from_mount;
                                         Vector6d step;
                                         step << 2e-3, 0, 0, 0, 0.5, 0;
                                         pose = retract(pose, step);
                                       }),
                               earlier_rig(), 1);
  ASSERT_TRUE(check) << check.error().message;
  ASSERT_FALSE(check->valid());
  EXPECT_EQ(check->parts[check->changed[0].part].name, "the place of track1") << all_named(*check);
  EXPECT_EQ(check->changed.size(), 1u) << all_named(*check);
  EXPECT_NEAR(check->parts[check->changed[0].part].change[0], 2e-3, 4e-4);
}

TEST(RigCheck, NamesTheTrackerWhoseFrameIsTheWorlds) {
  const auto check = check_rig(interim(22,
                                       [](Rig& rig) {
                                         Vector6d step;
                                         step << 0, 2e-3, 0, 0, 0, 0;
                                         Pose& pose = rig.sensors[1].sensor_from_mount;
                                         pose = retract(pose, step);
                                       }),
                               earlier_rig(), 1);
  ASSERT_TRUE(check) << check.error().message;
  ASSERT_FALSE(check->valid());
  EXPECT_EQ(check->parts[check->changed[0].part].name, "the place of track0") << all_named(*check);
}

TEST(RigCheck, NamesTheLedThatWasBent) {
  const auto check = check_rig(interim(23, [](Rig& rig) { rig.leds[3].position_mm.x() += 1; }), earlier_rig(), 1);
  ASSERT_TRUE(check) << check.error().message;
  ASSERT_FALSE(check->valid());
  EXPECT_EQ(check->parts[check->changed[0].part].name, "LED led3") << all_named(*check);
  EXPECT_NEAR(check->parts[check->changed[0].part].change.norm(), 1, 0.3);
}

}  // namespace
}  // namespace crumple
