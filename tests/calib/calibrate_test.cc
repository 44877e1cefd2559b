#include "calib/calibrate.h"

#include <cmath>
#include <random>
#include <set>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "calib/verdict.h"
#include "tests/calib/synthetic_data.h"

namespace crumple {
namespace {

double worst_relative_error(const Rig& found, const Rig& truth) {
  double worst = 0;
  for (std::size_t s = 0; s < truth.sensors.size(); ++s) {
    const auto& a = found.sensors[s].lens.parameters();
    const auto& b = truth.sensors[s].lens.parameters();
    for (std::size_t i = 0; i < b.size(); ++i)
      worst = std::max(worst, std::abs(a[i] - b[i]) / std::max(1.0, std::abs(b[i])));
    worst = std::max(worst,
                     local_step(truth.sensors[s].sensor_from_mount, found.sensors[s].sensor_from_mount).norm() / 250);
  }
  return worst;
}

// From nothing but observations, through the closed forms, with an offset projector lens.
TEST(Calibrate, RecoversTheRigFromNoiseFreeObservations) {
  const Synthetic made = make_synthetic({.warp_mm = {0.4, -0.3}});
  const auto found = calibrate(data_of(made), {.warp = WarpChoice::on});
  ASSERT_TRUE(found) << found.error().message;
  EXPECT_LT(worst_relative_error(found->bundle.state.rig, made.truth.rig), 1e-6);
}

TEST(Calibrate, RecoversTheRigFromProjectedFeaturesAlone) {
  const Synthetic made = make_synthetic({});
  CalibrationData data = data_of(made);
  data.observations.stripes.clear();
  const auto found = calibrate(data, {.warp = WarpChoice::off});
  ASSERT_TRUE(found) << found.error().message;
  EXPECT_LT(worst_relative_error(found->bundle.state.rig, made.truth.rig), 1e-6);
}

// With known noise; what is estimated of it differs from one set of observations to another.
TEST(Calibrate, StripesAndProjectedFeaturesTogetherKnowMore) {
  const Synthetic made = make_synthetic({.corner_sigma_px = 0.05, .stripe_sigma_px = 0.05, .feature_sigma_px = 0.05});
  const auto sigma_of_fx = [&](bool stripes, bool features) {
    Observations seen = made.observations;
    if (!stripes) seen.stripes.clear();
    if (!features) seen.features.clear();
    BundleOptions options{.reject_outliers = false, .estimate_known_sigmas = false};
    for (const char* group : {"cam0.corners", "proj0.stripes", "cam0.features"}) options.known_sigma_px[group] = 0.05;
    const auto bundle = refine(made.truth, seen, options);
    EXPECT_TRUE(bundle);
    return bundle ? std::sqrt(bundle->covariance.of({{BlockId::Kind::lens, 1}}, bundle->state)(0, 0)) : 0.0;
  };
  const double both = sigma_of_fx(true, true);
  EXPECT_LT(both, 0.99 * sigma_of_fx(false, true));
  EXPECT_LT(both, 0.99 * sigma_of_fx(true, false));
}

// Two of eight stations were taken out of step with the projector, which reads half of every coordinate there.
TEST(Calibrate, StationsOutOfStepAreNamedAndHaveNoPart) {
  Synthetic made =
      make_synthetic({.placements = 8, .corner_sigma_px = 0.05, .stripe_sigma_px = 0.05, .feature_sigma_px = 0.05});
  const std::set<std::size_t> lost{0, 5};
  for (StripeView& view : made.observations.stripes) {
    if (!lost.contains(view.placement)) continue;
    for (double& coordinate_px : view.coordinates_px) coordinate_px *= 0.5;
  }
  CalibrationData data = data_of(made);
  data.observations.features.clear();
  for (PixelPairs& view : data.pairs) {
    if (!lost.contains(view.placement)) continue;
    for (Eigen::Vector2d& pixel : view.projector_pixels) pixel *= 0.5;
  }
  const auto found = calibrate(data, {});
  ASSERT_TRUE(found) << found.error().message;
  const double focal_px = made.truth.rig.sensors[1].lens.parameters()[0];
  EXPECT_NEAR(found->bundle.state.rig.sensors[1].lens.parameters()[0], focal_px, 0.003 * focal_px);
  const std::vector<std::string> reasons = judge(*found).reasons;
  for (const char* station : {"station p0", "station p5"}) {
    EXPECT_THAT(reasons,
                testing::Contains(testing::AllOf(testing::HasSubstr(station), testing::HasSubstr("out of step"))));
  }
}

// Boards up to 85 degrees off a fisheye's axis. From its closed forms to a rational lens without a fold the way leads
// through lenses that fold within the corners.
TEST(Calibrate, StartsAVeryWideLens) {
  const Lens lens = Lens::create("LENSMODEL_OPENCV8", {6016, 4016},
                                 {2075, 2079, 3005, 1998, 0.53, 0.036, 7e-5, 0, 1.7e-4, 0.819, 0.1186, 2.27e-3})
                        .value();
  const Board board = Board::grid(10, 10, 77);
  std::mt19937_64 generator(5);
  std::normal_distribution<double> noise_px(0, 0.4);
  std::uniform_real_distribution<double> uniform(-1, 1);
  CalibrationData data;
  data.sensors = {{"cam0", SensorKind::camera, lens.size(), lens.model()}};
  data.boards = {{"board", {10, 10, 77}, {}}};
  std::size_t seen = 0;
  double widest = 0;
  for (std::size_t p = 0; seen < 60; ++p) {
    const double off_axis = 1.3 * static_cast<double>(p % 13) / 12, around = 2.4 * static_cast<double>(p);
    const Eigen::Vector3d axis(-std::sin(around), std::cos(around), 0);
    const Eigen::Quaterniond turn = rotation_from_vector(off_axis * axis);
    const Eigen::Quaterniond tilt =
        rotation_from_vector({0.6 * uniform(generator), 0.6 * uniform(generator), 3 * uniform(generator)});
    const Pose pose{turn * tilt, turn * (Eigen::Vector3d(0, 0, 750) - tilt * Eigen::Vector3d(346.5, 346.5, 0))};
    CornerView view{0, seen, {}, {}};
    for (int i = 0; i < board.point_count(); ++i) {
      const Eigen::Vector3d point = pose * board.point(i);
      const auto pixel = lens.project(point);
      const double slope = point.head<2>().norm() / point.z();
      if (!pixel || slope > 12.8 || !lens.size().contains(*pixel)) continue;
      widest = std::max(widest, slope);
      view.corners.push_back(i);
      view.pixels.push_back(*pixel + Eigen::Vector2d::NullaryExpr([&](Eigen::Index) { return noise_px(generator); }));
    }
    if (view.corners.size() < 60) continue;
    data.board_of.push_back(0);
    data.placement_names.push_back(std::to_string(seen++));
    data.observations.corners.push_back(std::move(view));
  }
  ASSERT_GT(widest, 11);
  data.observations.placement_count = seen;
  const auto calibration = calibrate(data, {});
  ASSERT_TRUE(calibration) << calibration.error().message;
  EXPECT_TRUE(calibration->bundle.settled);
  EXPECT_NEAR(calibration->bundle.groups.front().sigma_px, 0.4, 0.02);
  const Lens& found = calibration->bundle.state.rig.sensors[0].lens;
  EXPECT_NEAR(found.parameters()[0], lens.parameters()[0], 3);
}

TEST(Calibrate, WarpHasToEarnItsPlace) {
  const SyntheticOptions flat{.corner_sigma_px = 0.1, .stripe_sigma_px = 0.05, .feature_sigma_px = 0.1, .seed = 11};
  SyntheticOptions bent = flat;
  bent.warp_mm = {0.5, 0.2};
  EXPECT_FALSE(calibrate(data_of(make_synthetic(flat)), {})->warp_estimated);
  EXPECT_TRUE(calibrate(data_of(make_synthetic(bent)), {})->warp_estimated);
}

TEST(Calibrate, NamesWhatIsMissing) {
  const Synthetic made = make_synthetic({.placements = 2});
  const auto few = calibrate(data_of(made), {});
  ASSERT_FALSE(few);
  EXPECT_THAT(few.error().message, testing::HasSubstr("cam0 sees the board in 2 placements"));

  Synthetic parallel = make_synthetic({.placements = 5});
  for (std::size_t p = 0; p < 5; ++p) {
    Pose& pose = parallel.truth.world_from_board[p];
    pose = {Eigen::Quaterniond::Identity(),
            {-160.0 + 12.0 * static_cast<double>(p), -120, 750.0 + 30.0 * static_cast<double>(p)}};
    CornerView& view = parallel.observations.corners[p];
    for (std::size_t i = 0; i < view.corners.size(); ++i) {
      view.pixels[i] =
          *parallel.truth.rig.sensors[0].lens.project(pose * parallel.truth.boards[0].point(view.corners[i]));
    }
  }
  const auto flat = calibrate(data_of(parallel), {});
  ASSERT_FALSE(flat);
  EXPECT_THAT(flat.error().message, testing::HasSubstr("focal length cannot be told"));
}

TEST(Verdict, NamesABadViewAndFewPlacements) {
  Synthetic made =
      make_synthetic({.placements = 4, .corner_sigma_px = 0.05, .stripe_sigma_px = 0.05, .feature_sigma_px = 0.05});
  for (std::size_t i = 0; i < 63; i += 2) made.observations.corners[2].pixels[i].x() += 1.5;
  const auto calibration = calibrate(data_of(made), {});
  ASSERT_TRUE(calibration) << calibration.error().message;
  const Verdict verdict = judge(*calibration);
  EXPECT_FALSE(verdict.ok);
  EXPECT_THAT(verdict.reasons, testing::Contains(testing::HasSubstr("station p2 is bad in cam0")));
  EXPECT_THAT(verdict.reasons, testing::Contains(testing::HasSubstr("only 4 board placements")));
}

TEST(Verdict, AGoodCampaignIsOk) {
  const Synthetic made =
      make_synthetic({.placements = 10, .corner_sigma_px = 0.1, .stripe_sigma_px = 0.05, .feature_sigma_px = 0.1});
  const auto calibration = calibrate(data_of(made), {});
  ASSERT_TRUE(calibration);
  EXPECT_THAT(judge(*calibration).reasons, testing::IsEmpty());
}

}  // namespace
}  // namespace crumple
