// What is left open of points does not depend on which frame the refinement held: to first order, for the frames held
// are off by their errors.
#include <gtest/gtest.h>

#include "calib/volume_uncertainty.h"
#include "tests/calib/made_system_data.h"
#include "tests/calib/synthetic_data.h"

namespace crumple {
namespace {

Calibration refined(const CalibrationData& data, const CalibrationState& truth, const BundleOptions& options) {
  auto bundle = refine(truth, data.observations, options);
  EXPECT_TRUE(bundle) << bundle.error().message;
  return {.placement_names = data.placement_names,
          .station_names = data.station_names,
          .start = truth,
          .bundle = std::move(*bundle)};
}

void expect_same_points(const CalibrationData& data, const CalibrationState& truth, std::size_t usual,
                        std::size_t other, Mount frame) {
  const BundleOptions held_usual{.reject_outliers = false};
  BundleOptions held_other = held_usual;
  held_other.freed = {{BlockId::Kind::mount, usual}};
  held_other.held = {{BlockId::Kind::mount, other}};
  const auto a = volume_points(data, refined(data, truth, held_usual));
  const auto b = volume_points(data, refined(data, truth, held_other));
  ASSERT_TRUE(a && b);
  EXPECT_EQ(a->frame, frame);
  ASSERT_EQ(a->points.size(), b->points.size());
  ASSERT_FALSE(a->points.empty());
  for (std::size_t i = 0; i < a->points.size(); ++i) {
    const Eigen::Matrix3d& covariance_mm2 = a->points[i].covariance_mm2;
    EXPECT_GT(covariance_mm2.trace(), 0);
    EXPECT_LT((covariance_mm2 - b->points[i].covariance_mm2).norm(), 5e-3 * covariance_mm2.norm()) << i;
  }
}

TEST(VolumePoints, OfAPairDependOnNoGauge) {
  const Synthetic made =
      make_synthetic({.placements = 8, .corner_sigma_px = 0.1, .stripe_sigma_px = 0.1, .feature_sigma_px = 0.1});
  expect_same_points(data_of(made), made.truth, 0, 1, Mount::probe);
}

TEST(VolumePoints, OfATrackedProbeDependOnNoGauge) {
  const MadeSystem made = make_system({.stations = 8, .placements = 2, .tracker_placements = 6});
  const auto& sensors = made.truth.rig.sensors;
  std::vector<std::size_t> trackers;
  for (std::size_t s = 0; s < sensors.size(); ++s) {
    if (sensors[s].mount == Mount::world) trackers.push_back(s);
  }
  expect_same_points(data_of(made), made.truth, trackers[0], trackers[1], Mount::world);
}

}  // namespace
}  // namespace crumple
