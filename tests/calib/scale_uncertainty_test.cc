#include "calib/scale_uncertainty.h"

#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "calib/calibrate.h"
#include "tests/solvers/synthetic.h"

namespace crumple {
namespace {

CalibrationData noisy_data() {
  const Synthetic made =
      make_synthetic({.placements = 6, .corner_sigma_px = 0.1, .stripe_sigma_px = 0.05, .feature_sigma_px = 0.1});
  CalibrationData data;
  for (const Sensor& sensor : made.truth.rig.sensors) {
    data.sensors.push_back({sensor.name, sensor.kind, sensor.lens.size(), sensor.lens.model()});
  }
  data.boards = {{"board", {9, 7, 40}, {}}};
  data.board_of = made.truth.board_of;
  data.observations = made.observations;
  for (std::size_t p = 0; p < made.observations.placement_count; ++p) {
    data.placement_names.push_back("p" + std::to_string(p));
    const FeatureView& features = made.observations.features[p];
    data.pairs.push_back({0, 1, p, features.camera_pixels, features.projector_pixels});
  }
  return data;
}

// Of |translation| of the projector.
double baseline_sigma(const Rig& rig) {
  const Eigen::Vector3d direction = rig.sensors[1].sensor_from_probe.translation.normalized();
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
  const double baseline = known.sensors[1].sensor_from_probe.translation.norm();
  EXPECT_NEAR(baseline_sigma(known), std::hypot(baseline_sigma(unknown), 0.002 * baseline), 1e-9 * baseline);
  EXPECT_EQ(known.covariance.names.back(), "scale");
  EXPECT_NEAR(std::sqrt(known.covariance.matrix.bottomRightCorner<1, 1>()(0, 0)), 0.002, 1e-15);
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
    EXPECT_LT((b.sensor_from_probe.translation - 1.001 * a.sensor_from_probe.translation).norm(), 1e-5);
    EXPECT_LT(a.sensor_from_probe.rotation.angularDistance(b.sensor_from_probe.rotation), 1e-8);
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
  EXPECT_NEAR(warm.sigma, 1e-5 * std::sqrt(4.0 + 4 + 1), 1e-15);
  EXPECT_EQ(missing_in(certificate, Temperature{30, 2}), "");
  EXPECT_THAT(missing_in(certificate, {}), testing::HasSubstr("temperature"));
  EXPECT_THAT(missing_in(BoardCertificate{.pitch_sigma_mm = 1}, {}), testing::HasSubstr("expansion"));

  CalibrationData data = noisy_data();
  data.boards[0].certificate = BoardCertificate{.pitch_sigma_mm = 0.01, .temperature_c = 20, .expansion_per_k = 1e-4};
  const double cold =
      calibrate(data, {.warp = WarpChoice::off})->bundle.state.rig.sensors[1].sensor_from_probe.translation.norm();
  data.temperature = Temperature{30, 0.1};
  const double hot =
      calibrate(data, {.warp = WarpChoice::off})->bundle.state.rig.sensors[1].sensor_from_probe.translation.norm();
  EXPECT_NEAR(hot / cold, 1.001, 1e-8);
}

TEST(ScaleUncertainty, OneBoardWithoutACertificateLeavesItUnknown) {
  const BoardSpec sure{"a", {9, 6, 25}, BoardCertificate{.pitch_sigma_mm = 0.01}};
  const BoardSpec surer{"b", {9, 6, 25}, BoardCertificate{.pitch_sigma_mm = 0.005}};
  const BoardSpec unsure{"c", {9, 6, 25}, {}};
  EXPECT_NEAR(scale_uncertainty({sure, surer, unsure}, {0, 1, 1}, {})->relative, 4e-4, 1e-15);
  EXPECT_FALSE(scale_uncertainty({sure, surer, unsure}, {0, 1, 2}, {}));
}

}  // namespace
}  // namespace crumple
