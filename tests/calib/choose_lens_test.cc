#include "calib/choose_lens.h"

#include <algorithm>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/calib/made_lens.h"
#include "tests/calib/made_system_data.h"
#include "tests/solvers/synthetic.h"

namespace crumple {
namespace {

constexpr ImageSize kSize{1024, 768};

LensChoice chosen(const std::string& model, const std::vector<double>& parameters, unsigned seed) {
  const MadeLens made = made_lens(Lens::create(model, kSize, parameters).value(), model, 0.1, seed);
  std::size_t steps = 0;
  const auto choices = choose_lenses(made.data, {.warp = WarpChoice::off}, [&] { ++steps; });
  EXPECT_TRUE(choices) << choices.error().message;
  EXPECT_EQ(steps, lens_choice_steps(made.data));
  return choices->front();
}

TEST(ChooseLens, APinholeGetsNoMore) {
  EXPECT_EQ(chosen("LENSMODEL_PINHOLE", {700, 705, 515, 380}, 1).model, "LENSMODEL_PINHOLE");
}

TEST(ChooseLens, FiveTermsAreTakenAndNoEighth) {
  const LensChoice choice = chosen("LENSMODEL_OPENCV5", {700, 705, 515, 380, -0.25, 0.12, 4e-4, -3e-4, -0.03}, 2);
  EXPECT_EQ(choice.model, "LENSMODEL_OPENCV5");
  ASSERT_EQ(choice.candidates.size(), 5U);
  EXPECT_GT(choice.candidates[0].held_out_rms_px, 1);
  EXPECT_NEAR(choice.candidates[2].rms_px, 0.1414, 0.01);
  EXPECT_NEAR(choice.candidates[2].held_out_rms_px, 0.1414, 0.02);
  EXPECT_FALSE(choice.candidates[3].taken);
}

TEST(ChooseLens, AStronglyRationalLensGetsItsDenominator) {
  EXPECT_EQ(chosen("LENSMODEL_OPENCV8", {600, 605, 515, 380, 1.5, 0.2, 4e-4, -3e-4, 0.01, 2.2, 0.9, 0.05}, 3).model,
            "LENSMODEL_OPENCV8");
}

// Cameras first, by their corners; then the projector.
TEST(ChooseLens, ProjectorsAreJudgedByTheirStripes) {
  const Synthetic made =
      make_synthetic({.placements = 9, .corner_sigma_px = 0.1, .stripe_sigma_px = 0.05, .model = "LENSMODEL_PINHOLE"});
  CalibrationData data;
  for (const Sensor& sensor : made.truth.rig.sensors) {
    data.sensors.push_back({sensor.name, sensor.kind, sensor.lens.size(), "LENSMODEL_OPENCV8"});
  }
  data.boards = {{"board", {9, 7, 40}, {}}};
  data.board_of = made.truth.board_of;
  data.observations = made.observations;
  data.observations.features.clear();
  for (std::size_t p = 0; p < made.observations.placement_count; ++p) {
    const FeatureView& features = made.observations.features[p];
    data.placement_names.push_back("p" + std::to_string(p));
    data.pairs.push_back({0, 1, p, features.camera_pixels, features.projector_pixels});
  }
  const auto choices = choose_lenses(data, {.warp = WarpChoice::off}, [] {});
  ASSERT_TRUE(choices) << choices.error().message;
  ASSERT_EQ(choices->size(), 2U);
  EXPECT_EQ((*choices)[1].kind, SensorKind::projector);
  EXPECT_EQ((*choices)[1].model, "LENSMODEL_PINHOLE");
  EXPECT_NEAR((*choices)[1].candidates[0].held_out_rms_px, 0.05, 0.02);
  for (const SensorSpec& sensor : with_lenses(data, *choices).sensors) {
    EXPECT_EQ(sensor.lens_model, "LENSMODEL_PINHOLE");
  }
}

// Of a tracked system the trackers have lenses of their own: here without distortion, unlike the probe's.
TEST(ChooseLens, TrackersAreJudgedByThemselves) {
  const MadeSystem made = make_system({.stations = 10, .tracker_placements = 10, .seed = 3, .change = [](Rig& rig) {
                                         for (Sensor& sensor : rig.sensors) {
                                           if (sensor.mount != Mount::world) continue;
                                           std::vector<double> parameters = sensor.lens.parameters();
                                           std::fill(parameters.begin() + 4, parameters.end(), 0);
                                           sensor.lens = sensor.lens.with_parameters(parameters);
                                         }
                                       }});
  const CalibrationData data = data_of(made);
  std::size_t steps = 0;
  const auto choices = choose_lenses(data, {.warp = WarpChoice::off}, [&] { ++steps; });
  ASSERT_TRUE(choices) << choices.error().message;
  EXPECT_EQ(steps, lens_choice_steps(data));
  ASSERT_EQ(choices->size(), 3U);
  const LensChoice &camera = (*choices)[0], &projector = (*choices)[1], &trackers = (*choices)[2];
  EXPECT_EQ(camera.mount, Mount::probe);
  EXPECT_NE(camera.model, "LENSMODEL_PINHOLE");
  EXPECT_EQ(projector.kind, SensorKind::projector);
  EXPECT_EQ(trackers.mount, Mount::world);
  EXPECT_EQ(trackers.model, "LENSMODEL_PINHOLE");
  for (const SensorSpec& sensor : with_lenses(data, *choices).sensors) {
    const LensChoice& choice = sensor.mount == Mount::world           ? trackers
                               : sensor.kind == SensorKind::projector ? projector
                                                                      : camera;
    EXPECT_EQ(sensor.lens_model, choice.model) << sensor.name;
  }
}

TEST(ChooseLens, TooFewBoardsBeforeTheTrackersAreToldAtOnce) {
  const CalibrationData data = data_of(make_system({.stations = 8, .tracker_placements = 2}));
  const auto choices = choose_lenses(data, {}, [] { FAIL() << "calibrated before looking"; });
  ASSERT_FALSE(choices);
  EXPECT_THAT(choices.error().message, testing::StartsWith("the trackers: choosing a lens model"));
}

TEST(ChooseLens, WantsPlacementsToHoldOut) {
  MadeLens made =
      made_lens(Lens::create("LENSMODEL_PINHOLE", kSize, {700, 705, 515, 380}).value(), "LENSMODEL_PINHOLE", 0.1, 1);
  while (made.data.placement_names.size() > 3) made.data = without_placement(made.data, 3);
  const auto choices = choose_lenses(made.data, {}, [] {});
  ASSERT_FALSE(choices);
  EXPECT_THAT(choices.error().message, testing::HasSubstr("4 board placements, not 3"));
}

}  // namespace
}  // namespace crumple
