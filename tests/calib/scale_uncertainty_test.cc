#include "calib/scale_uncertainty.h"

#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "calib/calibrate.h"
#include "tests/calib/synthetic_data.h"

namespace crumple {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

CalibrationData noisy_data() {
  return data_of(
      make_synthetic({.placements = 6, .corner_sigma_px = 0.1, .stripe_sigma_px = 0.05, .feature_sigma_px = 0.1}));
}

// Of |translation| of the projector.
double baseline_sigma(const Rig& rig) {
  const Eigen::Vector3d direction = rig.sensors[1].sensor_from_mount.translation.normalized();
  const auto& names = rig.covariance.names;
  const auto row = std::find(names.begin(), names.end(), "proj0.translation_x") - names.begin();
  return std::sqrt(direction.dot(rig.covariance.matrix.block<3, 3>(row, row) * direction));
}

TEST(ScaleUncertainty, ABaselineHoldsTheCertificates) {
  CalibrationData data = noisy_data();
  const CalibrationOptions options{.warp = WarpChoice::on};
  const Rig unknown = calibrated_rig(calibrate(data, options).value());
  data.boards[0].certificate = BoardCertificate{.pitch_sigma_mm = 0.08};  // 0.2 % of the pitch
  const Calibration calibration = calibrate(data, options).value();
  const Rig known = calibrated_rig(calibration);
  const double baseline = known.sensors[1].sensor_from_mount.translation.norm();
  EXPECT_NEAR(baseline_sigma(known), std::hypot(baseline_sigma(unknown), 0.002 * baseline), 1e-9 * baseline);
  const auto& names = known.covariance.names;
  const auto row = std::find(names.begin(), names.end(), "board.scale") - names.begin();
  ASSERT_LT(row, known.covariance.matrix.rows());
  EXPECT_NEAR(std::sqrt(known.covariance.matrix(row, row)), 0.002, 1e-12);
  EXPECT_NEAR(calibration.scale->relative, 0.002, 1e-12);
}

// That nothing else moves with the scale, by measuring with a board that is larger by a thousandth.
TEST(ScaleUncertainty, TheRigScalesWithItsBoard) {
  CalibrationData data = noisy_data();
  const CalibrationOptions options{.warp = WarpChoice::on};
  const CalibrationState nominal = calibrate(data, options)->bundle.state;
  data.boards[0].target.pitch_mm *= 1.001;
  const CalibrationState larger = calibrate(data, options)->bundle.state;
  for (std::size_t s = 0; s < 2; ++s) {
    const Sensor &a = nominal.rig.sensors[s], &b = larger.rig.sensors[s];
    // As far as both refinements converged; the scale itself moves the baseline by 0.2 mm.
    EXPECT_LT((b.sensor_from_mount.translation - 1.001 * a.sensor_from_mount.translation).norm(), 1e-5);
    EXPECT_LT(a.sensor_from_mount.rotation.angularDistance(b.sensor_from_mount.rotation), 1e-8);
    for (std::size_t i = 0; i < a.lens.parameters().size(); ++i) {
      EXPECT_NEAR(a.lens.parameters()[i], b.lens.parameters()[i], 1e-4);
    }
  }
  EXPECT_LT((larger.boards[0].warp_mm - 1.001 * nominal.boards[0].warp_mm).norm(), 1e-5);
}

TEST(ScaleUncertainty, TemperatureEntersScaleAndUncertainty) {
  const BoardCertificate certificate{
      .pitch_sigma_mm = 0.001, .temperature_c = 20, .expansion_per_k = 1e-5, .expansion_sigma_per_k = 1e-6};
  const ScalePrior warm = scale_prior(certificate, 50, Temperature{30, 2});
  EXPECT_NEAR(warm.scale, 1.0001, 1e-15);
  // Pitch 2e-5, temperature 1e-5 * 2, expansion 10 * 1e-6.
  EXPECT_NEAR(warm.sigma(), 1e-5 * std::sqrt(4.0 + 4 + 1), 1e-15);

  CalibrationData data = noisy_data();
  data.boards[0].certificate = BoardCertificate{.pitch_sigma_mm = 0.01, .temperature_c = 20, .expansion_per_k = 1e-4};
  const double cold =
      calibrate(data, {.warp = WarpChoice::off})->bundle.state.rig.sensors[1].sensor_from_mount.translation.norm();
  data.temperature = Temperature{30, 0.1};
  const double hot =
      calibrate(data, {.warp = WarpChoice::off})->bundle.state.rig.sensors[1].sensor_from_mount.translation.norm();
  EXPECT_NEAR(hot / cold, 1.001, 1e-8);
}

// At the certificate's temperature alone the expansion's uncertainty has no part in the scale.
TEST(ScaleUncertainty, WhatIsNotStatedIsMissing) {
  BoardCertificate certificate{.pitch_sigma_mm = 1};
  const auto missing = [&](const std::optional<Temperature>& capture) {
    return missing_in(certificate, "board 'b'", capture);
  };
  const std::string expansion = "the thermal expansion of board 'b' is not stated",
                    sigma = "the standard uncertainty of the thermal expansion of board 'b' is not stated",
                    temperature = "the temperature during the calibration is not stated";
  const Temperature warm{30, 2}, as_certified{20, 2};
  EXPECT_THAT(missing(warm), ElementsAre(expansion));
  EXPECT_THAT(missing({}), ElementsAre(expansion, temperature));
  certificate.expansion_per_k = 1e-5;
  EXPECT_THAT(missing(warm), ElementsAre(sigma));
  EXPECT_THAT(missing({}), ElementsAre(sigma, temperature));
  EXPECT_THAT(missing(as_certified), IsEmpty());
  certificate.expansion_sigma_per_k = 0;
  EXPECT_THAT(missing(warm), IsEmpty());
  EXPECT_THAT(missing({}), ElementsAre(temperature));
}

// The first half of the placements is of the first board; the second board's true pitch is larger by 0.1 % than stated.
CalibrationData of_two_boards(std::optional<BoardCertificate> first, std::optional<BoardCertificate> second) {
  CalibrationData data = noisy_data();
  BoardSpec other = data.boards[0];
  data.boards[0].certificate = first;
  other.name = "other";
  other.certificate = second;
  other.target.pitch_mm /= 1.001;
  data.boards.push_back(other);
  for (std::size_t p = data.board_of.size() / 2; p < data.board_of.size(); ++p) data.board_of[p] = 1;
  return data;
}

// The baseline ties the boards: its certificate tells the scale, and the images the other board's.
TEST(ScaleUncertainty, ABoardWithACertificateTellsTheOthersSize) {
  const CalibrationData data = of_two_boards(BoardCertificate{.pitch_sigma_mm = 0.0004}, {});
  const Calibration calibration = calibrate(data, {.warp = WarpChoice::off}).value();
  const CalibrationState& state = calibration.bundle.state;
  const double sigma = std::sqrt(calibration.bundle.covariance.of({{BlockId::Kind::scale, 1}}, state)(0, 0));
  EXPECT_GT(sigma, 1e-5);
  EXPECT_LT(sigma, 5e-4);
  EXPECT_NEAR(state.boards[1].scale, 1.001, 3 * sigma);
  EXPECT_NEAR(state.boards[0].scale, 1, 1e-5);
  EXPECT_NEAR(calibration.scale->relative, sigma, 1e-12);
  const std::vector<MeasuredScale> measured = measured_scales(data, calibration.bundle, whole_covariance(calibration));
  ASSERT_EQ(measured.size(), 1u);  // the certified board is not one
  EXPECT_EQ(measured[0].board, 1u);
  EXPECT_TRUE(measured[0].determined);
  EXPECT_DOUBLE_EQ(measured[0].scale, state.boards[1].scale);
  EXPECT_NEAR(measured[0].sigma, sigma, 1e-12);
}

// The camera alone: neither board's size has to do with the other's.
TEST(ScaleUncertainty, ABoardThatNothingTiesIsNotMeasured) {
  CalibrationData data = of_two_boards(BoardCertificate{.pitch_sigma_mm = 0.0004}, {});
  data.sensors.resize(1);
  data.pairs.clear();
  data.observations.stripes.clear();
  data.observations.features.clear();
  const Calibration calibration = calibrate(data, {.warp = WarpChoice::off}).value();
  const std::vector<MeasuredScale> measured = measured_scales(data, calibration.bundle, whole_covariance(calibration));
  ASSERT_EQ(measured.size(), 1u);
  EXPECT_EQ(measured[0].board, 1u);
  EXPECT_FALSE(measured[0].determined);
  EXPECT_NEAR(measured[0].sigma, 0.05, 1e-4);  // the weak prior's
}

// Two certificates that differ by 0.1 %, both of 0.05 %: each gives way by half.
TEST(ScaleUncertainty, CertificatesAreWeighedAgainstEachOther) {
  const BoardCertificate certificate{.pitch_sigma_mm = 0.02};
  const Calibration calibration = calibrate(of_two_boards(certificate, certificate), {.warp = WarpChoice::off}).value();
  const CalibrationState& state = calibration.bundle.state;
  const double sigma = std::sqrt(calibration.bundle.covariance.of({{BlockId::Kind::scale, 0}}, state)(0, 0));
  EXPECT_NEAR(state.boards[0].scale, 0.9995, 2e-4);
  EXPECT_NEAR(state.boards[1].scale, 1.0005, 2e-4);
  EXPECT_NEAR(sigma, 0.0005 / std::sqrt(2), 2e-5);
  // What either lacks, and what both lack once.
  EXPECT_THAT(calibration.scale->lacks, ElementsAre("the thermal expansion of board 'board' is not stated",
                                                    "the temperature during the calibration is not stated",
                                                    "the thermal expansion of board 'other' is not stated"));
  EXPECT_EQ(calibrated_rig(calibration).scale_lacks, calibration.scale->lacks);
}

TEST(ScaleUncertainty, TheTemperatureErrsForAllBoardsAlike) {
  const BoardCertificate certificate{
      .pitch_sigma_mm = 1e-5, .temperature_c = 20, .expansion_per_k = 1e-5, .expansion_sigma_per_k = 0};
  CalibrationData data = of_two_boards(certificate, certificate);
  data.boards[1].target = data.boards[0].target;
  data.temperature = Temperature{20, 20};
  const Calibration calibration = calibrate(data, {.warp = WarpChoice::off}).value();
  EXPECT_NEAR(calibration.scale->relative, 2e-4, 1e-6);  // not over sqrt(2)
}

TEST(ScaleUncertainty, WithoutAnyCertificateItIsUnknown) {
  const Calibration calibration = calibrate(of_two_boards({}, {}), {.warp = WarpChoice::off}).value();
  EXPECT_FALSE(calibration.scale);
  EXPECT_THAT(calibrated_rig(calibration).scale_lacks, IsEmpty());
  EXPECT_EQ(calibration.bundle.state.boards[1].scale, 1);
}

}  // namespace
}  // namespace crumple
