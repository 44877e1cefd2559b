#include "calib/rig_difference.h"

#include <algorithm>
#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "solvers/bundle.h"
#include "tests/solvers/made_system.h"

namespace crumple {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

Rig calibrated_from(const CalibrationState& start, const Observations& observations) {
  const auto result = refine(start, observations, {.reject_outliers = false});
  if (!result) throw std::runtime_error(result.error().message);
  Rig rig = result->state.rig;
  rig.covariance = result->covariance.of_rig_and(result->body_motions);
  return rig;
}

// A camera and a projector from a campaign of their own for every seed.
Rig camera_and_projector(unsigned seed, const char* model = "LENSMODEL_OPENCV5") {
  MadeSystem made = make_system(
      {.trackers = 0, .leds = 0, .stations = 8, .tracker_placements = 0, .corner_sigma_px = 0.1, .seed = seed});
  for (Sensor& sensor : made.truth.rig.sensors) {
    std::vector<double> parameters = sensor.lens.parameters();
    parameters.resize(lens_parameter_names(model).size());
    sensor.lens = Lens::create(model, sensor.lens.size(), parameters).value();
  }
  return calibrated_from(made.truth, made.observations);
}

// Made once.
const Rig& first_rig() {
  static const Rig rig = camera_and_projector(1);
  return rig;
}

const Rig& second_rig() {
  static const Rig rig = camera_and_projector(2);
  return rig;
}

RigDifference compared(const Rig& a, const Rig& b, const RigDifferenceOptions& options = {}) {
  auto difference = rig_difference(a, b, options);
  if (!difference) throw std::runtime_error(difference.error().message);
  return std::move(*difference);
}

Rig nudged(Rig rig, const char* sensor, const Vector6d& step) {
  Pose& pose = rig.sensors[*rig.find(sensor)].sensor_from_mount;
  pose = retract(pose, step);
  return rig;
}

TEST(RigDifference, OfARigAndItselfIsNothing) {
  const Rig& rig = first_rig();
  const RigDifference difference = compared(rig, rig);
  EXPECT_FALSE(difference.significant());
  ASSERT_EQ(difference.sensors.size(), 2u);
  ASSERT_EQ(difference.pairs.size(), 1u);
  for (const SensorDrift& sensor : difference.sensors) EXPECT_LT(sensor.projection.px.rms(), 1e-8);
  EXPECT_LT(difference.pairs[0].volume.mm.rms(), 1e-6);
  EXPECT_GT(difference.pairs[0].volume.mm.expected_rms(), 1e-3);
}

// Independent calibrations of the same rig: the statistics are as large as
// their degrees of freedom say, and at k = 2 nineteen of twenty are found
// unchanged.
TEST(RigDifference, FindsAnUnchangedRigUnchanged) {
  constexpr int kPairs = 8;
  int significant = 0, degrees = 0;
  double statistic = 0;
  for (unsigned pair = 0; pair < kPairs; ++pair) {
    const RigDifference difference =
        compared(camera_and_projector(100 + 2 * pair), camera_and_projector(101 + 2 * pair));
    significant += difference.significant();
    for (const SensorDrift& sensor : difference.sensors) {
      statistic += sensor.projection.px.statistic;
      degrees += sensor.projection.px.degrees;
      EXPECT_LT(sensor.projection.px.unexplained, 0.3 * sensor.projection.px.expected_rms());
    }
    statistic += difference.pairs[0].volume.mm.statistic;
    degrees += difference.pairs[0].volume.mm.degrees;
  }
  // Sensors and pair share their lenses: half as many are independent.
  EXPECT_NEAR(statistic / degrees, 1, 4 * std::sqrt(2.0 / (0.5 * degrees)));
  EXPECT_LE(significant,
            4);  // 1.1 expected; five or more have a probability of 0.004
}

TEST(RigDifference, NamesANudgedProjector) {
  const Rig& a = first_rig();
  const Rig b = nudged(second_rig(), "proj0", (Vector6d() << 0, 1e-3, 0, 0.2, 0, 0).finished());
  const RigDifference difference = compared(a, b);
  EXPECT_THAT(difference.changed, ElementsAre("proj0 has moved against cam0"));
  EXPECT_FALSE(difference.sensors[0].significant || difference.sensors[1].significant);
  const PairDrift& pair = difference.pairs[0];
  EXPECT_TRUE(pair.significant);
  EXPECT_NEAR(pair.turned_rad, 1e-3, 3e-4);
  EXPECT_GT(pair.volume.mm.rms(), pair.volume.mm.expected_rms());
  // The same at another significance, if that is not beyond reason.
  EXPECT_TRUE(compared(a, b, {.k = 4}).significant());
  EXPECT_FALSE(compared(a, b, {.k = 1000}).significant());
}

TEST(RigDifference, NamesALensThatChanged) {
  const Rig& a = first_rig();
  Rig b = second_rig();
  std::vector<double> parameters = b.sensors[0].lens.parameters();
  parameters[4] += 0.02;
  b.sensors[0].lens = b.sensors[0].lens.with_parameters(parameters);
  const RigDifference difference = compared(a, b);
  EXPECT_THAT(difference.changed, ElementsAre("the lens of cam0 images otherwise"));
  EXPECT_TRUE(difference.sensors[0].significant);
  EXPECT_FALSE(difference.sensors[1].significant);
}

TEST(RigDifference, ComparesLensModelsThatDiffer) {
  const Rig &a = first_rig(), b = camera_and_projector(1, "LENSMODEL_OPENCV4");
  const RigDifference difference = compared(a, b);
  ASSERT_EQ(difference.sensors.size(), 2u);
  for (const SensorDrift& sensor : difference.sensors) {
    EXPECT_EQ(sensor.model_b, "LENSMODEL_OPENCV4");
    EXPECT_TRUE(sensor.parameters.empty());
    EXPECT_FALSE(sensor.significant);
  }
  EXPECT_FALSE(difference.significant());
}

TEST(RigDifference, SaysWhatOnlyOneHas) {
  const Rig& a = first_rig();
  Rig b = a;
  b.sensors[1].name = "proj1";
  const RigDifference difference = compared(a, b);
  EXPECT_THAT(difference.only_a, ElementsAre("proj0"));
  EXPECT_THAT(difference.only_b, ElementsAre("proj1"));
  EXPECT_THAT(difference.pairs, IsEmpty());
  Rig bare = a;
  bare.covariance = {};
  const auto refused = rig_difference(a, bare, {});
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().message, HasSubstr("second rig has no covariance"));
}

Rig tracked(unsigned seed) {
  const MadeSystem made = make_system({.trackers = 3, .stations = 8, .tracker_placements = 6, .seed = seed});
  return calibrated_from(made.truth, made.observations);
}

TEST(RigDifference, TellsWhatMovedInATrackedSystem) {
  const Rig a = tracked(1), b = tracked(2);
  const RigDifference same = compared(a, b);
  EXPECT_FALSE(same.significant()) << same.changed.front();
  ASSERT_TRUE(same.leds && same.leds->leds.of_measured);
  EXPECT_EQ(same.pairs.size(), 4u);  // camera and projector, three of trackers

  const RigDifference tracker = compared(a, nudged(b, "track1", (Vector6d() << 0, 2e-3, 0, 2, 0, 0).finished()));
  EXPECT_THAT(tracker.changed, ElementsAre("track1 has moved against the other sensors"));

  Rig hand_eye = b;
  for (Led& led : hand_eye.leds) led.position_mm += Eigen::Vector3d(1.5, 0, 0);
  const RigDifference leds = compared(a, hand_eye);
  EXPECT_FALSE(leds.leds->shape_significant);
  EXPECT_THAT(leds.changed, ElementsAre("the LEDs have moved against cam0 and proj0"));

  Rig bent = b;
  bent.leds[2].position_mm.x() += 3;
  EXPECT_TRUE(compared(a, bent).leds->shape_significant);
}

}  // namespace
}  // namespace crumple
