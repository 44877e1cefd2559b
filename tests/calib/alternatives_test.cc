#include "calib/alternatives.h"

#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "calib/swapped_axes.h"
#include "recon/patterns.h"
#include "tests/calib/made_system_data.h"
#include "tests/solvers/noisy_observations.h"

namespace crumple {
namespace {

using testing::Contains;
using testing::ContainsRegex;
using testing::HasSubstr;
using testing::IsEmpty;

const NoiseLevels kNoise{0.1, 0.1, 0, 0.05};

MadeSystem quiet_system(int trackers) {
  return make_system({.trackers = trackers,
                      .stations = 12,
                      .placements = 2,
                      .tracker_placements = 8,
                      .led_sigma_px = 0,
                      .corner_sigma_px = 0,
                      .stripe_sigma_px = 0});
}

AlternativeTests tested(MadeSystem made) {
  std::mt19937_64 random(5);
  add_noise(kNoise, random, made.observations);
  const CalibrationData data = data_of(made);
  // What the camera side is about is not the start: the nominal boards, flat and of nominal size.
  CalibrationState start = made.truth;
  start.boards[0].scale = 1;
  auto bundle = refine(start, made.observations, {});
  if (!bundle) {
    ADD_FAILURE() << bundle.error().message;
    return {};
  }
  const Calibration calibration{.placement_names = data.placement_names,
                                .station_names = data.station_names,
                                .start = start,
                                .bundle = std::move(*bundle)};
  const auto tests = test_alternatives(data, calibration, 1);
  EXPECT_TRUE(tests) << tests.error().message;
  return tests ? *tests : AlternativeTests{};
}

TEST(Alternatives, NoneIsFoundWhereTheModelIsRight) {
  const AlternativeTests tests = tested(quiet_system(2));
  EXPECT_GT(tests.tested, 50);
  EXPECT_THAT(tests.found, IsEmpty());
  EXPECT_THAT(tests.untestable_sizes, IsEmpty());  // each board could contradict the other
  // From how much on it would: 0.5 % are found in the test of a wrong pitch.
  ASSERT_EQ(tests.size_limits.size(), 2u);
  EXPECT_GT(tests.size_limits[0].detectable, 1e-5);
  EXPECT_LT(tests.size_limits[0].detectable, 0.005);
}

TEST(Alternatives, AnLedThatWasTouchedIsNamedWithTheStation) {
  MadeSystem made = quiet_system(3);
  CalibrationState touched = made.truth;
  touched.rig.leds[3].position_mm += Eigen::Vector3d(0.25, -0.2, 0.1);
  const Observations after = predicted_observations(touched, made.observations);
  for (std::size_t v = 0; v < after.leds.size(); ++v) {
    if (after.leds[v].station && *after.leds[v].station >= 6) made.observations.leds[v] = after.leds[v];
  }
  const AlternativeTests tests = tested(std::move(made));
  ASSERT_EQ(tests.found.size(), 1u);
  EXPECT_EQ(tests.found[0].kind, AlternativeKind::led);
  EXPECT_THAT(tests.found[0].sentence, HasSubstr("LED led3 was moved by 0.3"));
  EXPECT_THAT(tests.found[0].sentence, HasSubstr("from station_6 on"));
}

TEST(Alternatives, OfTwoBoardsOneHasAnotherPitch) {
  MadeSystem made = quiet_system(2);
  made.truth.boards[0].scale = 1.005;
  made.observations = predicted_observations(made.truth, made.observations);
  const AlternativeTests tests = tested(std::move(made));
  ASSERT_FALSE(tests.found.empty());
  EXPECT_EQ(tests.found[0].kind, AlternativeKind::size);
  EXPECT_THAT(tests.found[0].sentence, HasSubstr("the pitch of board"));
  EXPECT_THAT(tests.found[0].sentence, HasSubstr("tracker_board"));
}

// The camera's lens has a strong k3, and is taken for one of OPENCV4.
TEST(Alternatives, ALensOfTooFewTermsIsNamedWithWhatItTakes) {
  MadeSystem made = quiet_system(2);
  Lens& lens = made.truth.rig.sensors[0].lens;
  std::vector<double> parameters = lens.parameters();
  parameters[8] = 30;
  lens = lens.with_parameters(parameters);
  made.observations = predicted_observations(made.truth, made.observations);
  parameters.resize(8);
  lens = Lens::create("LENSMODEL_OPENCV4", lens.size(), std::move(parameters)).value();
  const AlternativeTests tests = tested(std::move(made));
  ASSERT_FALSE(tests.found.empty());
  EXPECT_EQ(tests.found[0].kind, AlternativeKind::lens);
  EXPECT_EQ(tests.found[0].subject, "the lens of cam0");
  EXPECT_THAT(tests.found[0].sentence, ContainsRegex("cam0: LENSMODEL_OPENCV4 does not follow its lens: "
                                                     "(LENSMODEL_OPENCV8|a splined lens) would explain"));
  EXPECT_THAT(tests.tested_lenses, Contains("the lens of proj0"));
}

// Readings are of edges between stripes: of the made ones those that lie near one.
TEST(Alternatives, EdgesThatAGammaShiftsAreNamedWithTheirSigns) {
  MadeSystem made = quiet_system(2);
  for (StripeView& view : made.observations.stripes) {
    std::vector<Eigen::Vector2d> pixels;
    std::vector<double> shifted_px;
    for (std::size_t i = 0; i < view.coordinates_px.size(); ++i) {
      const double edge = std::round(view.coordinates_px[i] + 0.5);
      if (std::abs(view.coordinates_px[i] + 0.5 - edge) > 0.25) continue;
      const auto stripe = static_cast<unsigned>(edge);
      pixels.push_back(view.camera_pixels[i]);
      shifted_px.push_back(view.coordinates_px[i] +
                           (gray_from_binary(stripe) > gray_from_binary(stripe - 1) ? 0.2 : -0.2));
    }
    view.camera_pixels = std::move(pixels);
    view.coordinates_px = std::move(shifted_px);
  }
  const AlternativeTests tests = tested(std::move(made));
  ASSERT_EQ(tests.found.size(), 1u);
  EXPECT_EQ(tests.found[0].kind, AlternativeKind::polarity);
  EXPECT_THAT(tests.found[0].sentence, ContainsRegex("rising edges of stripes are off by \\+0\\.(19|2|21) px"));
}

TEST(SwappedAxes, AreNamedAndOnlyThen) {
  const MadeSystem made = make_system({.stations = 8, .placements = 2, .tracker_placements = 6});
  const CalibrationData data = data_of(made);
  const CalibrationOptions flat{.warp = WarpChoice::off};
  const auto right = calibrate(data, flat);
  ASSERT_TRUE(right) << right.error().message;
  EXPECT_FALSE(find_swapped_axes(data, flat, &*right));
  const CalibrationData swapped = with_swapped_axes(data);
  const auto wrong = calibrate(swapped, flat);
  const auto said = find_swapped_axes(swapped, flat, wrong ? &*wrong : nullptr);
  ASSERT_TRUE(said);
  EXPECT_THAT(*said, HasSubstr("columns and rows are exchanged"));
}

}  // namespace
}  // namespace crumple
