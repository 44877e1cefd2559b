// From observations to the verdict's words.
#include "calib/verdict.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/calib/made_system_data.h"
#include "tests/calib/synthetic_data.h"
#include "tests/solvers/noisy_observations.h"

namespace crumple {
namespace {

using testing::AllOf;
using testing::Contains;
using testing::ContainsRegex;
using testing::HasSubstr;
using testing::Not;

constexpr NoiseLevels kVerdictNoise{0.1, 0.1, 0, 0.05};
const CalibrationOptions kFlatBoards{.warp = WarpChoice::off};

Synthetic probe_before_boards() {
  Synthetic made = make_synthetic({.placements = 8});
  made.observations.features.clear();
  return made;
}

// What the camera and the projector see of these placements, with noise.
CalibrationData seen(Synthetic made, unsigned seed = 1) {
  const Synthetic pairs = make_synthetic({.placements = static_cast<int>(made.truth.world_from_board.size())});
  made.observations = predicted_observations(made.truth, made.observations);
  std::mt19937_64 random(seed);
  add_noise(kVerdictNoise, random, made.observations);
  Observations observations = made.observations;
  made.observations.features = pairs.observations.features;  // for the start's pairs alone
  CalibrationData data = data_of(made);
  data.observations = std::move(observations);
  return data;
}

Verdict verdict_on(const CalibrationData& data, const CalibrationOptions& options = kFlatBoards) {
  const auto calibration = calibrate(data, options);
  if (!calibration) {
    ADD_FAILURE() << calibration.error().message;
    return {};
  }
  return judge(data, *calibration, 1);
}

TEST(Verdict, OfAGoodCalibrationSaysWhatItIsGoodFor) {
  const Verdict verdict = verdict_on(seen(probe_before_boards()));
  EXPECT_EQ(level_of(verdict), "ok") << testing::PrintToString(verdict.reasons);
  EXPECT_THAT(verdict.notes, Contains(HasSubstr("the scale's uncertainty is unknown")));
  EXPECT_THAT(verdict.notes,
              Contains(AllOf(HasSubstr("a richer model would not describe the lens of cam0"), HasSubstr("proj0"))));
  EXPECT_THAT(verdict.notes, Not(Contains(HasSubstr("form a pattern"))));
  EXPECT_THAT(verdict.notes, Not(Contains(HasSubstr("extrapolated"))));
}

TEST(Verdict, AKnownScaleIsNotSaidToBeUnknown) {
  CalibrationData data = seen(probe_before_boards());
  data.boards[0].certificate = BoardCertificate{.pitch_sigma_mm = 0.004};
  EXPECT_THAT(verdict_on(data).notes, Not(Contains(HasSubstr("the scale's uncertainty is unknown"))));
}

TEST(Verdict, TooFewTiltsAreSaid) {
  Synthetic made = probe_before_boards();
  for (Pose& pose : made.truth.world_from_board) {
    const Eigen::Vector3d turn = rotation_vector(pose.rotation);
    pose.rotation = rotation_from_vector({0.2 * turn.x(), 0.2 * turn.y(), turn.z()});
  }
  const Calibration calibration{.placement_names = std::vector<std::string>(8, "p"),
                                .start = made.truth,
                                .bundle = refine(made.truth, seen(made).observations, {}).value()};
  EXPECT_THAT(judge(calibration).reasons, Contains(HasSubstr("the board's tilts span only")));
}

// Parallel, and at one depth.
TEST(Verdict, AFocalLengthThatBoardsAllAlikeCannotTellIsRejected) {
  Synthetic made = make_synthetic({.placements = 3});
  made.observations.features.clear();
  for (Pose& pose : made.truth.world_from_board) {
    pose.rotation = Eigen::Quaterniond::Identity();
    pose.translation.z() = 800;
  }
  const Calibration calibration{.placement_names = std::vector<std::string>(3, "p"),
                                .start = made.truth,
                                .bundle = refine(made.truth, seen(made).observations, {}).value()};
  const Verdict verdict = judge(calibration);
  EXPECT_TRUE(verdict.rejected);
  EXPECT_THAT(verdict.reasons, Contains(HasSubstr("the board's tilts span only 0 degrees")));
  EXPECT_THAT(verdict.reasons, Contains(HasSubstr("the focal length is known to")));
}

TEST(Verdict, AGroupOfManyOutliersIsNamed) {
  CalibrationData data = seen(probe_before_boards());
  std::mt19937_64 random(2);
  Observations spoiled = data.observations;
  add_gross_errors(0.12, kVerdictNoise, random, spoiled);
  data.observations.corners = spoiled.corners;
  EXPECT_THAT(verdict_on(data).reasons, Contains(AllOf(HasSubstr("cam0.corners: "), HasSubstr("are outliers"))));
}

// A window pane before a part of the image.
TEST(Verdict, APatternOverTheImageIsNoted) {
  CalibrationData data = seen(probe_before_boards());
  for (CornerView& view : data.observations.corners) {
    for (Eigen::Vector2d& pixel : view.pixels) {
      if (pixel.x() < 341 && pixel.y() < 256) pixel.y() += 0.5;
    }
  }
  EXPECT_THAT(
      verdict_on(data).notes,
      Contains(AllOf(HasSubstr("the residuals of cam0.corners form a pattern over its image, most of all upper left"),
                     HasSubstr("chi-square"))));
}

TEST(Verdict, BoardsAtOneDistanceAreNoted) {
  Synthetic made = probe_before_boards();
  for (Pose& pose : made.truth.world_from_board) {
    const Eigen::Vector3d turn = rotation_vector(pose.rotation);
    pose.rotation = rotation_from_vector({0.35 * turn.x(), 0.35 * turn.y(), turn.z()});
    const Eigen::Vector3d centre = pose * made.truth.boards[0].point(31);
    pose.translation *= 900 / centre.z();
  }
  const Calibration calibration{.placement_names = std::vector<std::string>(8, "p"),
                                .start = made.truth,
                                .bundle = refine(made.truth, seen(made).observations, {}).value()};
  const CalibrationData data = seen(made);
  EXPECT_THAT(judge(data, calibration, 1).notes, Contains(HasSubstr("nearer and farther everything is extrapolated")));
}

std::vector<std::string> all_said(const Verdict& verdict) {
  std::vector<std::string> all = verdict.reasons;
  all.insert(all.end(), verdict.notes.begin(), verdict.notes.end());
  return all;
}

// A probe's board, a larger one before the trackers and a scale bar put down twice.
CalibrationData beside_a_bar() {
  const MadeSystem made = make_system({.projector = false, .stations = 12, .bar_mm = 1100, .bar_places = 2});
  CalibrationData data = data_of(made);
  const std::size_t first = data.leds.size() - 4;
  EXPECT_EQ(data.leds[first].name, "bar0a");
  data.bars = {{"bar", {{first, first + 1}, {first + 2, first + 3}}, 1100, {.pitch_sigma_mm = 0.011}, 0}};
  return data;
}

TEST(Verdict, ARightPitchBesideABarIsNotSpokenOf) {
  const std::vector<std::string> said = all_said(verdict_on(beside_a_bar()));
  EXPECT_THAT(said, Not(Contains(HasSubstr("the pitch of board"))));
  EXPECT_THAT(said, Not(Contains(HasSubstr("wrong pitch"))));
  EXPECT_THAT(said, Not(Contains(HasSubstr("the size of board"))));
}

// Typed 25 where it is 24.
TEST(Verdict, AWrongPitchBesideABarIsNamedWithTheMeasuredOne) {
  CalibrationData data = beside_a_bar();
  data.boards[0].target.pitch_mm *= 25.0 / 24;
  const Verdict verdict = verdict_on(data);
  EXPECT_THAT(verdict.reasons,
              Contains(ContainsRegex("the pitch of board 'board' is off by -(4|3\\.9|4\\.0).* %: 31.25 mm "
                                     "is stated, .* (29\\.9|30\\.0)[0-9]* mm \\(u = 0\\.0")));
  EXPECT_THAT(all_said(verdict), Not(Contains(HasSubstr("the pitch of board 'tracker_board'"))));
}

// The second half of the placements is of another board, without a certificate beside one that has one.
CalibrationData of_a_certified_board_and_another() {
  CalibrationData data = seen(probe_before_boards());
  BoardSpec other = data.boards[0];
  other.name = "other";
  data.boards[0].certificate = BoardCertificate{.pitch_sigma_mm = 0.002};
  data.boards.push_back(other);
  for (std::size_t p = data.board_of.size() / 2; p < data.board_of.size(); ++p) data.board_of[p] = 1;
  return data;
}

TEST(Verdict, WhatAPrinterMakesOfAPitchIsNoted) {
  CalibrationData data = of_a_certified_board_and_another();
  EXPECT_THAT(all_said(verdict_on(data)), Not(Contains(HasSubstr("the pitch of board"))));
  data.boards[1].target.pitch_mm /= 1.002;
  const Verdict verdict = verdict_on(data);
  EXPECT_THAT(verdict.notes, Contains(ContainsRegex("the pitch of board 'other' is off by \\+0\\.(1[789]|2)")));
  EXPECT_THAT(verdict.reasons, Not(Contains(HasSubstr("the pitch of board"))));
}

// One camera sees each board by itself.
TEST(Verdict, ABoardThatNothingTiesToACertifiedOneHasNoMeasuredSize) {
  CalibrationData data = of_a_certified_board_and_another();
  data.sensors.resize(1);
  data.pairs.clear();
  data.observations.stripes.clear();
  const std::vector<std::string> notes = verdict_on(data).notes;
  EXPECT_THAT(notes, Contains(HasSubstr("do not tie the size of board 'other' to bars or certified boards")));
  EXPECT_THAT(notes,
              Contains(AllOf(HasSubstr("nothing here could contradict the size of"), HasSubstr("board 'other'"))));
  EXPECT_THAT(notes, Not(Contains(AllOf(HasSubstr(".scale"), HasSubstr("a lens model with fewer terms")))));
}

}  // namespace
}  // namespace crumple
