// Planning: what is predicted of a view is what taking it gives.
#include "calib/next_view.h"

#include <algorithm>
#include <random>
#include <set>

#include <Eigen/LU>
#include <gtest/gtest.h>

#include "calib/seen_boards.h"
#include "calib/view_information.h"
#include "tests/calib/made_system_data.h"
#include "tests/calib/synthetic_data.h"

namespace crumple {
namespace {

// No outliers to look for, flat boards and known noise: two calibrations differ by their views alone.
CalibrationOptions planned_options() {
  CalibrationOptions options;
  options.warp = WarpChoice::off;
  options.bundle.reject_outliers = false;
  options.bundle.estimate_known_sigmas = false;
  options.bundle.known_sigma_px = {{"cam0.corners", 0.1}, {"proj0.stripes", 0.1}};
  return options;
}

CalibrationData data_of_pair(const Synthetic& made) {
  CalibrationData data = data_of(made);
  data.observations.features.clear();
  return data;
}

// The suggested view as it would be taken of the true rig, added to the data; and a start that has its pose.
CalibrationState take(const ViewCandidate& candidate, const Calibration& calibration, const Rig& truth,
                      CalibrationData& data) {
  Calibration of_truth = calibration;
  of_truth.bundle.state.rig = truth;
  const PredictedView view = predicted_view(candidate, data, of_truth);
  std::mt19937_64 generator(7);
  const auto add_noise = [&](double sigma_px, std::vector<Eigen::Vector2d>& pixels) {
    std::normal_distribution<double> noise(0, sigma_px);
    for (Eigen::Vector2d& pixel : pixels) pixel += Eigen::Vector2d(noise(generator), noise(generator));
  };
  Observations& all = data.observations;
  for (CornerView corners : view.observations.corners) {
    add_noise(0.1, corners.pixels);
    all.corners.push_back(corners);
  }
  for (LedView leds : view.observations.leds) {
    add_noise(0.05, leds.pixels);
    all.leds.push_back(leds);
  }
  std::normal_distribution<double> noise(0, 0.1);
  for (StripeView stripes : view.observations.stripes) {
    for (double& coordinate_px : stripes.coordinates_px) coordinate_px += noise(generator);
    all.stripes.push_back(stripes);
  }
  all.placement_count = view.observations.placement_count;
  data.board_of = view.state.board_of;
  data.placement_names.resize(all.placement_count, "suggested");
  data.station_names.resize(view.state.world_from_probe.size(), "suggested");
  CalibrationState start = view.state;
  start.rig = calibration.bundle.state.rig;
  return start;
}

TEST(ViewInformation, UpdatesACovariance) {
  Eigen::Matrix3d covariance, lambda;
  covariance << 4, 1, 1e-3, 1, 2, 0, 1e-3, 0, 1e-4;
  lambda << 1, 0.2, 0, 0.2, 0.04, 0, 0, 0, 1e4;  // of rank two
  const Eigen::Matrix3d expected = (covariance.inverse() + lambda).inverse();
  const Eigen::Matrix3d found = covariance - covariance * gain_of(lambda, covariance) * covariance;
  EXPECT_LT((found - expected)
                .cwiseQuotient(expected.diagonal().cwiseSqrt() * expected.diagonal().cwiseSqrt().transpose())
                .cwiseAbs()
                .maxCoeff(),
            1e-12);
}

TEST(NextView, PredictionIsWhatARecalibrationGives) {
  const Synthetic made = make_synthetic({.placements = 5, .corner_sigma_px = 0.1, .stripe_sigma_px = 0.1});
  CalibrationData data = data_of_pair(made);
  auto calibration = calibrate(data, planned_options());
  ASSERT_TRUE(calibration) << calibration.error().message;
  const auto next = next_views(data, *calibration, 2, 1);
  ASSERT_TRUE(next) << next.error().message;
  ASSERT_EQ(next->suggestions.size(), 2U);
  EXPECT_TRUE(next->triangulated);
  EXPECT_EQ(next_views(data, *calibration, 2, 2)->suggestions[1].after, next->suggestions[1].after);  // to the bit
  for (const SuggestedView& suggestion : next->suggestions) {
    take(suggestion.view, *calibration, made.truth.rig, data);
    calibration = calibrate(data, planned_options());
    ASSERT_TRUE(calibration) << calibration.error().message;
    const auto reached = next_views(data, *calibration, 0, 1);
    ASSERT_TRUE(reached) << reached.error().message;
    EXPECT_LT(suggestion.after, 0.95 * suggestion.before);
    EXPECT_NEAR(reached->now / suggestion.after, 1, 0.03);
  }
}

// Boards that all face the camera but for three degrees: the focal length trades places with the distance.
TEST(NextView, WhereTiltsLackOneIsSuggested) {
  Synthetic made = make_synthetic({.placements = 6});
  CalibrationData data = data_of_pair(made);
  data.sensors.resize(1);
  data.observations.stripes.clear();
  data.pairs.clear();
  const Board& board = made.truth.boards[0];
  for (CornerView& view : data.observations.corners) {
    const double angle = 1.1 * static_cast<double>(view.placement);
    Pose& pose = made.truth.world_from_board[view.placement];
    const Eigen::Vector3d centre = pose * board_centre(board);
    pose.rotation = rotation_from_vector({0.05 * std::cos(angle), 0.05 * std::sin(angle), 0});
    pose.translation = centre - pose.rotation * board_centre(board);
    for (std::size_t i = 0; i < view.corners.size(); ++i) {
      view.pixels[i] = *made.truth.rig.sensors[0].lens.project(pose * board.point(view.corners[i]));
    }
  }
  CalibrationState state = made.truth;
  state.rig.sensors.pop_back();
  const auto bundle = refine(state, data.observations, planned_options().bundle);
  ASSERT_TRUE(bundle) << bundle.error().message;
  const Calibration calibration{.start = state, .bundle = *bundle};
  const auto next = next_views(data, calibration, 1, 1);
  ASSERT_TRUE(next) << next.error().message;
  ASSERT_EQ(next->suggestions.size(), 1U);
  EXPECT_FALSE(next->triangulated);
  const SuggestedView& first = next->suggestions.front();
  EXPECT_GT(std::abs(first.view.about_vertical_rad) + std::abs(first.view.about_horizontal_rad), 0.5);
  EXPECT_LT(first.after, 0.7 * first.before);
}

// The probe stands before its board once more, or is shown to the trackers alone; they see its LEDs.
class OfATrackedProbe : public testing::TestWithParam<bool> {};

TEST_P(OfATrackedProbe, PredictionIsWhatARecalibrationGives) {
  const bool before_a_board = GetParam();
  const MadeSystem made = make_system({.stations = 5, .tracker_placements = 12});
  CalibrationData data = data_of(made);
  BundleOptions options = planned_options().bundle;
  for (const char* group : {"track0.corners", "track1.corners"}) options.known_sigma_px[group] = 0.1;
  for (const char* group : {"track0.leds", "track1.leds"}) options.known_sigma_px[group] = 0.05;
  auto bundle = refine(made.truth, data.observations, options);
  ASSERT_TRUE(bundle) << bundle.error().message;
  const Calibration calibration{.start = made.truth, .bundle = *bundle};
  // Nobody wants to show the trackers their board once more.
  const auto of_the_probe = [](CalibrationData all) {
    std::erase_if(all.observations.corners, [](const CornerView& view) { return !view.station; });
    return all;
  };
  std::vector<ViewCandidate> candidates = view_candidates(of_the_probe(data), calibration);
  std::erase_if(candidates, [&](const ViewCandidate& of) { return of.board.has_value() != before_a_board; });
  const auto next = next_views(of_the_probe(data), calibration, candidates, 1, 2);
  ASSERT_TRUE(next) << next.error().message;
  EXPECT_TRUE(next->triangulated);
  ASSERT_EQ(next->suggestions.size(), 1U);
  const SuggestedView& suggestion = next->suggestions.front();
  EXPECT_EQ(suggestion.view.placement.has_value(), before_a_board);
  EXPECT_EQ(suggestion.view.like_station.has_value(), !before_a_board);
  const Observations shown = predicted_view(suggestion.view, data, calibration).observations;
  EXPECT_EQ(shown.leds.size(), 2U);
  EXPECT_EQ(shown.corners.empty(), !before_a_board);
  EXPECT_LT(suggestion.after, suggestion.before);
  const CalibrationState start = take(suggestion.view, calibration, made.truth.rig, data);
  bundle = refine(start, data.observations, options);
  ASSERT_TRUE(bundle) << bundle.error().message;
  const auto reached = next_views(of_the_probe(data), {.start = start, .bundle = *bundle}, 0, 1);
  ASSERT_TRUE(reached) << reached.error().message;
  EXPECT_NEAR(reached->now / suggestion.after, 1, 0.03);
}

INSTANTIATE_TEST_SUITE_P(NextView, OfATrackedProbe, testing::Bool());

// The LEDs lie where the candidate's words say: in its part of the image, at its distance.
TEST(ViewCandidates, ShowLedsAloneWhereTheySay) {
  const MadeSystem made = make_system({.projector = false, .stations = 5, .wand_stations = 2, .tracker_placements = 8});
  const CalibrationData data = data_of(made);
  auto bundle = refine(made.truth, data.observations, planned_options().bundle);
  ASSERT_TRUE(bundle) << bundle.error().message;
  const Calibration calibration{.start = made.truth, .bundle = *bundle};
  std::set<std::size_t> trackers;
  std::set<std::pair<int, int>> parts;
  for (const ViewCandidate& candidate : view_candidates(data, calibration)) {
    if (candidate.board) continue;
    trackers.insert(candidate.camera);
    parts.emplace(candidate.column, candidate.row);
    EXPECT_FALSE(candidate.placement);
    ASSERT_TRUE(candidate.like_station);
    const PredictedView view = predicted_view(candidate, data, calibration);
    EXPECT_TRUE(view.observations.corners.empty() && view.observations.stripes.empty());
    const Sensor& tracker = view.state.rig.sensors[candidate.camera];
    const auto like = std::find_if(
        data.observations.leds.begin(), data.observations.leds.end(),
        [&](const LedView& of) { return of.sensor == candidate.camera && of.station == candidate.like_station; });
    ASSERT_NE(like, data.observations.leds.end());
    Eigen::Vector3d middle = Eigen::Vector3d::Zero();
    for (const std::size_t led : like->leds) {
      middle += view.state.rig.leds[led].position_mm / static_cast<double>(like->leds.size());
    }
    const Eigen::Vector3d in_tracker = tracker.sensor_from_mount * (view.state.world_from_probe.back() * middle);
    EXPECT_NEAR(in_tracker.z(), candidate.distance_mm, 1e-6);
    const Eigen::Vector2d pixel = *tracker.lens.project(in_tracker);
    const Eigen::Vector2d third(tracker.lens.size().width_px / 3.0, tracker.lens.size().height_px / 3.0);
    for (const auto& [of, part] : {std::pair(0, candidate.column), std::pair(1, candidate.row)}) {
      // Moved inwards to three quarters, a half or a quarter at most.
      const double offset = pixel[of] / third[of] - 1.5;
      EXPECT_NEAR(offset * part, std::abs(offset), 1e-6);
      EXPECT_GT(std::abs(offset), part == 0 ? -1 : 0.24);
      EXPECT_LT(std::abs(offset), part == 0 ? 1e-6 : 1.001);
    }
  }
  EXPECT_EQ(trackers.size(), 2U);
  EXPECT_EQ(parts.size(), 9U);
}

}  // namespace
}  // namespace crumple
