#include "calib/rig_truth.h"

#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "solvers/rig_covariance.h"
#include "tests/solvers/made_system.h"

namespace crumple {
namespace {

using testing::Contains;
using testing::Each;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;
using testing::StartsWith;

constexpr double kSigma = 0.25;  // of every parameter

// A probe, LEDs in the room, and two trackers that were moved.
Rig moved_rig() {
  Rig rig = make_system({.leds = 3, .stations = 4, .tracker_placements = 2, .room_leds = 2, .moved_trackers = true})
                .truth.rig;
  std::vector<std::string>& names = rig.covariance.names;
  for (const char* const sensor : {"proj0", "track1", "track0b", "track1b"}) {
    for (const char* const row : kPoseRows) names.push_back(std::string(sensor) + "." + row);
  }
  for (const Led& led : rig.leds) {
    for (const char axis : {'x', 'y', 'z'}) names.push_back(led.name + "." + axis);
  }
  const auto rows = static_cast<Eigen::Index>(names.size());
  rig.covariance.matrix = kSigma * kSigma * Eigen::MatrixXd::Identity(rows, rows);
  return rig;
}

Rig without(Rig rig, const std::string& name) {
  std::erase_if(rig.sensors, [&](const Sensor& sensor) { return sensor.name == name; });
  std::erase_if(rig.leds, [&](const Led& led) { return led.name == name; });
  return rig;
}

std::vector<std::string> names_of(const RigTruth& compared) {
  std::vector<std::string> names;
  for (const ParameterTruth& parameter : compared.parameters) names.push_back(parameter.name);
  return names;
}

TEST(RigTruth, StatesErrorsInSigmas) {
  const Rig truth = moved_rig();
  Rig estimated = truth;
  estimated.sensors[*estimated.find("track1")].sensor_from_mount.translation.x() += 0.5;
  const auto compared = compare_with_true_rig(estimated, truth);
  ASSERT_TRUE(compared) << compared.error().message;
  EXPECT_THAT(compared->not_compared, IsEmpty());
  EXPECT_EQ(compared->parameters.size(), truth.covariance.names.size());
  for (const ParameterTruth& parameter : compared->parameters) {
    const double error = parameter.name == "track1.translation_x" ? 0.5 : 0;
    EXPECT_NEAR(parameter.error, error, 1e-9) << parameter.name;
    EXPECT_NEAR(parameter.z, error / kSigma, 1e-8) << parameter.name;
  }
}

// A simulation knows every tracker at one place.
TEST(RigTruth, NamesMovedTrackersThatTheTruthDoesNotKnowAndComparesTheRest) {
  const Rig estimated = moved_rig();
  const auto compared = compare_with_true_rig(estimated, without(without(estimated, "track1b"), "track0b"));
  ASSERT_TRUE(compared) << compared.error().message;
  EXPECT_THAT(compared->not_compared, ElementsAre("track0b", "track1b"));
  EXPECT_EQ(compared->parameters.size(), estimated.covariance.names.size() - 2 * kPoseRows.size());
  EXPECT_THAT(names_of(*compared), Contains("track1.translation_x"));
  EXPECT_THAT(names_of(*compared), Each(Not(StartsWith("track0b."))));
}

TEST(RigTruth, NamesLedsThatTheTruthDoesNotKnow) {
  const Rig estimated = moved_rig();
  const auto compared = compare_with_true_rig(estimated, without(estimated, "led1"));
  ASSERT_TRUE(compared) << compared.error().message;
  EXPECT_THAT(compared->not_compared, ElementsAre("led1"));
}

// Without the first tracker nothing of the world can be compared; the probe can.
TEST(RigTruth, NamesWhatIsInAFrameThatTheTruthDoesNotKnow) {
  const Rig estimated = without(without(moved_rig(), "track1b"), "track0b");
  const auto compared = compare_with_true_rig(estimated, without(estimated, "track0"));
  ASSERT_TRUE(compared) << compared.error().message;
  EXPECT_THAT(compared->not_compared, ElementsAre("track0", "track1", "room0", "room1"));
  EXPECT_THAT(names_of(*compared), Contains("proj0.translation_x"));
}

TEST(RigTruth, FailsWhereTheTruthKnowsNoSensor) {
  const Rig estimated = moved_rig();
  Rig other = estimated;
  for (Sensor& sensor : other.sensors) sensor.name = "other_" + sensor.name;
  const auto compared = compare_with_true_rig(estimated, other);
  ASSERT_FALSE(compared);
  EXPECT_THAT(compared.error().message, HasSubstr("none of the rig's sensors"));
}

}  // namespace
}  // namespace crumple
