#include "calib/lens_prior.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "calib/verdict.h"
#include "tests/calib/made_lens.h"

namespace crumple {
namespace {

using testing::Contains;
using testing::HasSubstr;
using testing::IsEmpty;

constexpr ImageSize kWeakSize{1024, 768};

Lens opencv5() {
  return Lens::create("LENSMODEL_OPENCV5", kWeakSize, {700, 705, 515, 380, -0.2, 0.08, 4e-4, -3e-4, 0}).value();
}

Calibration calibrated(const Lens& lens, const std::string& model, double sigma_px = 0.1) {
  const MadeLens made = made_lens(lens, model, sigma_px, 4);
  auto calibration = calibrate(made.data, {.warp = WarpChoice::off});
  EXPECT_TRUE(calibration) << calibration.error().message;
  return *std::move(calibration);
}

// The largest distance between two lenses' pixels of one direction, where boards were, after the turn of the one that
// fits the other best: what a lens model is for. (A splined lens can take up a turn of its frame.)
double worst_difference_px(const Lens& truth, const Lens& found) {
  constexpr double kWidest = 0.45;
  std::vector<Eigen::Vector2d> pixels;
  std::vector<Eigen::Vector3d> directions;
  Eigen::Matrix3d turn = Eigen::Matrix3d::Zero();
  for (int x = 40; x < kWeakSize.width_px; x += 59) {
    for (int y = 40; y < kWeakSize.height_px; y += 57) {
      const auto ray = truth.ray({x, y}), other = found.ray({x, y});
      if (!ray || ray->head<2>().norm() > kWidest) continue;
      if (!other) return 1e9;
      pixels.emplace_back(x, y);
      directions.push_back(ray->normalized());
      turn += other->normalized() * directions.back().transpose();
    }
  }
  turn = nearest_rotation(turn);
  double worst = 0;
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    const auto pixel = found.project(turn * directions[i]);
    worst = std::max(worst, pixel ? (*pixel - pixels[i]).norm() : 1e9);
  }
  return worst;
}

TEST(LensPrior, PolynomialLensesNeedNone) {
  CalibrationState state;
  state.rig.sensors = {{"cam0", SensorKind::camera, opencv5(), {}}};
  EXPECT_THAT(lens_priors(state), IsEmpty());
}

TEST(LensPrior, AllowsTheFarthestCornerToMoveByAThirdOfItsRadius) {
  CalibrationState state;
  state.rig.sensors = {{"cam0",
                        SensorKind::camera,
                        Lens::undistorted("LENSMODEL_OPENCV8", kWeakSize, 500, 500, {511.5, 383.5}).value(),
                        {}}};
  const std::vector<Prior> priors = lens_priors(state);
  ASSERT_EQ(priors.size(), 1U);
  EXPECT_TRUE(priors[0].weak());
  const double slope = 640.0 / 500;
  EXPECT_NEAR(priors[0].sigmas()[0], 0.3 * std::pow(slope, -2), 1e-12);
  EXPECT_NEAR(priors[0].sigmas()[2], 0.3 * std::pow(slope, -6), 1e-12);
}

// Without the prior this is refused: k4 k5 k6 repeat what k1 k2 k3 say.
TEST(LensPrior, HoldsARationalLensAndNamesWhatItHolds) {
  const Calibration calibration = calibrated(opencv5(), "LENSMODEL_OPENCV8");
  ASSERT_THAT(calibration.bundle.undetermined, testing::Not(IsEmpty()));
  EXPECT_EQ(calibration.bundle.undetermined[0].prior, "cam0.weak");
  const Verdict verdict = judge(calibration);
  EXPECT_THAT(verdict.notes, Contains(HasSubstr("cam0.k")));
  EXPECT_THAT(verdict.reasons, IsEmpty());
  EXPECT_LT(worst_difference_px(opencv5(), calibration.bundle.state.rig.sensors[0].lens), 0.5);
}

// The single terms of the quotient may move along a valley where it hardly changes; all else stays, and so does the
// image.
TEST(LensPrior, DoesNotMoveWhatTheDataDetermine) {
  const Lens lens =
      Lens::create("LENSMODEL_OPENCV8", kWeakSize, {600, 605, 515, 380, 1.5, 0.2, 4e-4, -3e-4, 0.01, 2.2, 0.9, 0.05})
          .value();
  const Calibration calibration = calibrated(lens, "LENSMODEL_OPENCV8");
  const Lens& found = calibration.bundle.state.rig.sensors[0].lens;
  const Eigen::MatrixXd covariance =
      calibration.bundle.covariance.of({{BlockId::Kind::lens, 0}}, calibration.bundle.state);
  for (const int i : {0, 1, 2, 3, 6, 7}) {
    const auto p = static_cast<std::size_t>(i);
    EXPECT_LT(std::abs(found.parameters()[p] - lens.parameters()[p]), 4 * std::sqrt(covariance(i, i))) << i;
  }
  EXPECT_LT(worst_difference_px(lens, found), 0.3);
}

// Control points could turn the whole image, and the sensor back: along that valley nothing is linear.
TEST(LensPrior, ASplinedLensKeepsItsAxis) {
  const std::string model = "LENSMODEL_SPLINED_STEREOGRAPHIC_order=3_Nx=8_Ny=7_fov_x_deg=110";
  const Calibration calibration = calibrated(opencv5(), model);
  const Lens& found = calibration.bundle.state.rig.sensors[0].lens;
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  for (const int column : {3, 4}) {
    for (const int row : {2, 3, 4}) {
      const auto at = static_cast<std::size_t>(4 + 2 * (row * 8 + column));
      mean += Eigen::Vector2d(found.parameters()[at], found.parameters()[at + 1]) / 6;
    }
  }
  EXPECT_LT(mean.norm(), 0.01);
  EXPECT_LT(calibration.bundle.covariance.condition(), 1e5);
}

class EveryLens : public testing::TestWithParam<std::pair<const char*, std::vector<double>>> {};

// From corners alone, through the closed forms: each model finds back a lens of its own kind.
TEST_P(EveryLens, IsCalibrated) {
  const auto& [model, parameters] = GetParam();
  const Lens lens = Lens::create(model, kWeakSize, parameters).value();
  const Calibration calibration = calibrated(lens, model, 0.05);
  EXPECT_NEAR(calibration.bundle.groups[0].sigma_px, 0.05, 0.005);
  EXPECT_LT(worst_difference_px(lens, calibration.bundle.state.rig.sensors[0].lens), 0.3);
}

std::vector<double> gentle_spline() {
  std::vector<double> parameters(4 + 2 * 8 * 7, 0.0);
  parameters[0] = parameters[1] = 700;
  parameters[2] = 515;
  parameters[3] = 380;
  for (std::size_t i = 4; i < parameters.size(); ++i) parameters[i] = 0.01 * std::sin(1.7 * static_cast<double>(i));
  return parameters;
}

INSTANTIATE_TEST_SUITE_P(
    Models, EveryLens,
    testing::Values(std::pair{"LENSMODEL_OPENCV12", std::vector<double>{700, 705, 515, 380, -0.2, 0.08, 4e-4, -3e-4, 0,
                                                                        0.05, 0, 0, 2e-3, 0, -1e-3, 0}},
                    std::pair{"LENSMODEL_CAHVOR", std::vector<double>{700, 705, 515, 380, 0.02, -0.01, 0, -0.15, 0.05}},
                    std::pair{"LENSMODEL_SPLINED_STEREOGRAPHIC_order=3_Nx=8_Ny=7_fov_x_deg=110", gentle_spline()}),
    [](const auto& lens) {
      const std::string model = std::string(lens.param.first).substr(10);
      return model.substr(0, model.find('_'));
    });

}  // namespace
}  // namespace crumple
