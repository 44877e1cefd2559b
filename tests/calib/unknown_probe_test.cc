#include "calib/unknown_probe.h"

#include <cmath>

#include <Eigen/Cholesky>
#include <gtest/gtest.h>

#include "solvers/closed_form/rigid_fit.h"
#include "tests/calib/made_system_data.h"

namespace crumple {
namespace {

// Trackers calibrated by boards alone; the probe's LEDs blink before them later.
EarlierRig calibrated_trackers(unsigned seed) {
  const MadeSystem made = make_system({.projector = false, .stations = 0, .tracker_placements = 15, .seed = seed});
  CalibrationData data = data_of(made);
  data.sensors.erase(data.sensors.begin());
  for (CornerView& view : data.observations.corners) --view.sensor;
  data.leds.clear();
  return {.rig = calibrated_rig(calibrate(data, {.warp = WarpChoice::off}).value())};
}

CalibrationData leds_alone(const MadeSystem& made) {
  CalibrationData data = data_of(made);
  data.sensors.erase(data.sensors.begin());
  for (LedView& view : data.observations.leds) --view.sensor;
  data.observations.placement_count = 0;
  data.placement_names.clear();
  data.board_of.clear();
  return data;
}

// The constellation's shape comes out as surely as is said, in the frame of the nominal places.
TEST(UnknownProbe, LedsComeOutAsSurelyAsIsSaid) {
  double sum = 0;
  int degrees = 0;
  for (unsigned seed = 1; seed <= 6; ++seed) {
    const EarlierRig trackers = calibrated_trackers(seed);
    const MadeSystem made = make_system(
        {.projector = false, .stations = 0, .wand_stations = 12, .tracker_placements = 0, .seed = 50 + seed});
    std::map<std::string, Eigen::Vector3d> nominal_mm;
    for (std::size_t l = 0; l < 4; ++l) {
      nominal_mm[made.truth.rig.leds[l].name] = made.truth.rig.leds[l].position_mm + Eigen::Vector3d(0.3, -0.2, 0.4);
    }
    const auto found = unknown_probe(leds_alone(made), trackers, nominal_mm, 1);
    ASSERT_TRUE(found) << found.error().message;
    std::vector<Eigen::Vector3d> estimates, truths;
    for (std::size_t l = 0; l < made.truth.rig.leds.size(); ++l) {
      EXPECT_LT((found->rig.leds[l].position_mm - made.truth.rig.leds[l].position_mm).norm(), 3);
      estimates.push_back(found->rig.leds[l].position_mm);
      truths.push_back(made.truth.rig.leds[l].position_mm);
    }
    const Pose found_from_true = rigid_fit(truths, estimates).value();
    const auto count = static_cast<Eigen::Index>(estimates.size());
    Eigen::VectorXd error(3 * count);
    for (Eigen::Index i = 0; i < count; ++i) {
      const auto l = static_cast<std::size_t>(i);
      error.segment<3>(3 * i) = estimates[l] - found_from_true * truths[l];
    }
    const auto& names = found->rig.covariance.names;
    const auto row = std::find(names.begin(), names.end(), "led0.x") - names.begin();
    const Eigen::MatrixXd covariance = found->rig.covariance.matrix.block(row, row, 3 * count, 3 * count);
    sum += error.dot(covariance.llt().solve(error));
    degrees += static_cast<int>(3 * count) - 6;
  }
  EXPECT_NEAR(sum / degrees, 1, 4 * std::sqrt(2.0 / degrees));
}

// A rig made that way can be gone on from.
TEST(UnknownProbe, ItsRigIsAPriorForMore) {
  const EarlierRig trackers = calibrated_trackers(1);
  MadeSystemOptions options{.projector = false, .stations = 0, .wand_stations = 8, .tracker_placements = 0, .seed = 61};
  const auto first = unknown_probe(leds_alone(make_system(options)), trackers, {}, 1);
  ASSERT_TRUE(first) << first.error().message;
  options.seed = 62;
  const auto more =
      calibrate(leds_alone(make_system(options)), {.warp = WarpChoice::off, .earlier = EarlierRig{.rig = first->rig}});
  ASSERT_TRUE(more) << more.error().message;
  const Rig rig = calibrated_rig(*more);
  const auto& names = first->rig.covariance.names;
  const auto row = std::find(names.begin(), names.end(), "led0.x") - names.begin();
  const auto now =
      std::find(rig.covariance.names.begin(), rig.covariance.names.end(), "led0.x") - rig.covariance.names.begin();
  EXPECT_LT(rig.covariance.matrix(now, now), first->rig.covariance.matrix(row, row));
}

}  // namespace
}  // namespace crumple
