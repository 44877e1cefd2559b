#include "calib/lens_prior.h"

#include <algorithm>
#include <cmath>

#include <Eigen/LU>
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
// fits the other best: what a lens model is for.
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

TEST(LensPrior, AllowsTheFarthestCornerToMoveByThirtyPercentOfItsRadius) {
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
  for (const char* grid : {"order=3_Nx=8_Ny=7_fov_x_deg=110", "order=3_Nx=8_Ny=6_fov_x_deg=44",
                           "order=2_Nx=3_Ny=3_fov_x_deg=60", "order=3_Nx=30_Ny=20_fov_x_deg=170"}) {
    CalibrationState state;
    const std::string model = std::string("LENSMODEL_SPLINED_STEREOGRAPHIC_") + grid;
    state.rig.sensors = {
        {"cam0", SensorKind::camera, Lens::undistorted(model, kWeakSize, 700, 700, {511.5, 383.5}).value(), {}}};
    const Lens& lens = state.rig.sensors[0].lens;
    const SplineGrid knots = lens.spline_grid();
    std::vector<Prior> priors = lens_priors(state);
    const auto axis = std::find_if(priors.begin(), priors.end(), [](auto& p) { return p.name() == "cam0.axis"; });
    ASSERT_NE(axis, priors.end());
    EXPECT_FALSE(axis->weak());
    // What the prior leaves of the four points' mean and of their turn about it.
    const Eigen::MatrixXd jacobian = axis->evaluate(state).jacobians[0];
    Eigen::MatrixXd of_points(jacobian.rows(), 8), combined = Eigen::MatrixXd::Zero(3, 8);
    std::vector<Eigen::Vector2d> at;
    ASSERT_EQ(axis->terms().size(), 8U);
    for (int i = 0; i < 8; i += 2) {
      const int row = axis->terms()[static_cast<std::size_t>(i)].row, point = (row - 4) / 2;
      of_points.col(i) = jacobian.col(row);
      of_points.col(i + 1) = jacobian.col(row + 1);
      at.emplace_back(knots.x[static_cast<std::size_t>(point) % knots.x.size()],
                      knots.y[static_cast<std::size_t>(point) / knots.x.size()]);
    }
    const Eigen::Vector2d middle = 0.25 * (at[0] + at[1] + at[2] + at[3]);
    double squares = 0;
    for (const Eigen::Vector2d& u : at) squares += (u - middle).squaredNorm();
    for (int i = 0; i < 4; ++i) {
      const Eigen::Vector2d u = (at[static_cast<std::size_t>(i)] - middle) / squares;
      combined.block<2, 2>(0, 2 * i) = 0.25 * Eigen::Matrix2d::Identity();
      combined(2, 2 * i) = -u.y();
      combined(2, 2 * i + 1) = u.x();
    }
    const Eigen::MatrixXd left = combined * (of_points.transpose() * of_points).inverse() * combined.transpose();
    for (int i = 0; i < 3; ++i) EXPECT_NEAR(std::sqrt(left(i, i)), 1e-4, 1e-6) << grid << " " << i;
  }
  const Calibration calibration =
      calibrated(opencv5(), "LENSMODEL_SPLINED_STEREOGRAPHIC_order=3_Nx=8_Ny=7_fov_x_deg=110");
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
