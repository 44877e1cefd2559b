#include "tracking/probe_pose.h"

#include <cmath>

#include <Eigen/LU>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/solvers/gradients.h"
#include "tests/tracking/made_station.h"
#include "tracking/paper_pose.h"
#include "tracking/pose_starts.h"

namespace crumple {
namespace {

using testing::HasSubstr;

double off_mm(const Pose& found, const Pose& truth) {
  const Vector6d step = local_step(truth, found);
  return step.tail<3>().norm() + 150 * step.head<3>().norm();
}

TEST(LedSighting, DerivativesMatchCentralDifferences) {
  const MadeStation station = make_station({});
  const auto sightings = led_sightings(station.rig, station.readings).value();
  for (const LedSighting& sighting : sightings) {
    SightingResidual at;
    ASSERT_TRUE(evaluate(sighting, station.world_from_probe, at));
    EXPECT_LT(at.residual_px.norm(), 1e-9);
    const auto moved = [&](const Eigen::VectorXd& step) {
      SightingResidual there;
      EXPECT_TRUE(evaluate(sighting, retract(station.world_from_probe, step), there));
      return Eigen::VectorXd(there.residual_px);
    };
    const Eigen::MatrixXd numeric = central_differences(moved, Eigen::VectorXd::Zero(6), 1e-5);
    EXPECT_LT((numeric - at.d_pose).cwiseAbs().maxCoeff(), 1e-5 * at.d_pose.cwiseAbs().maxCoeff());
  }
}

TEST(ProbePose, ExactPixelsGiveThePose) {
  for (const int trackers : {1, 2, 3, 5}) {
    for (const int leds : {4, 5, 8, 20}) {
      const MadeStation station = make_station({.leds = leds, .trackers = trackers});
      const auto found = probe_pose(station.rig, station.readings);
      ASSERT_TRUE(found) << trackers << " " << leds << " " << found.error().message;
      EXPECT_LT(off_mm(found->world_from_probe, station.world_from_probe), 1e-5);
      EXPECT_EQ(found->redundancy, 2 * leds * trackers - 6);
      if (trackers == 1) continue;
      const auto paper = paper_pose(station.rig, station.readings);
      ASSERT_TRUE(paper) << paper.error().message;
      EXPECT_LT(off_mm(paper->world_from_probe, station.world_from_probe), 1e-5);
    }
  }
}

TEST(ProbePose, ThreeLedsAndTwoTrackersSuffice) {
  const MadeStation station = make_station({.leds = 3, .trackers = 2});
  const auto found = probe_pose(station.rig, station.readings);
  ASSERT_TRUE(found) << found.error().message;
  EXPECT_LT(off_mm(found->world_from_probe, station.world_from_probe), 1e-5);
}

TEST(ProbePose, ThreeLedsAndOneTrackerNeedToKnowRoughlyWhere) {
  const MadeStation station = make_station({.leds = 3, .trackers = 1});
  const std::string refusal = probe_pose(station.rig, station.readings).error().message;
  EXPECT_THAT(refusal, HasSubstr("explain the LEDs' pixels alike"));
  EXPECT_THAT(refusal, HasSubstr("at 40 -30 3000 mm"));  // the true one among them
  EXPECT_THAT(refusal, HasSubstr("--near"));
  Vector6d step;
  step << 0.05, -0.05, 0.02, 10, -10, 30;
  const NearPose near{retract(station.world_from_probe, step), "station before"};
  const auto found = probe_pose(station.rig, station.readings, {.near = near});
  ASSERT_TRUE(found) << found.error().message;
  EXPECT_LT(off_mm(found->world_from_probe, station.world_from_probe), 1e-4);
  EXPECT_EQ(found->redundancy, 0);
  ASSERT_TRUE(found->choice);
  EXPECT_GE(found->choice->poses, 2U);
  EXPECT_EQ(found->choice->near, "station before");
  EXPECT_NEAR(found->choice->turn_rad, step.head<3>().norm(), 1e-5);
  EXPECT_NEAR(found->choice->place_mm, step.tail<3>().norm(), 1e-3);
}

// Turned from one of the poses towards the other by so much of the turn between them.
TEST(ProbePose, TheStatedPoseMustBeClearlyNearerToOneOfThem) {
  const MadeStation station = make_station({.leds = 3, .trackers = 1});
  const Pose& truth = station.world_from_probe;
  const auto sightings = led_sightings(station.rig, station.readings).value();
  const auto other = probe_pose(station.rig, station.readings, {.near = NearPose{mirrored(sightings, truth)[0], ""}});
  ASSERT_TRUE(other) << other.error().message;
  ASSERT_EQ(other->choice->poses, 2U);
  ASSERT_GT(off_mm(other->world_from_probe, truth), 10);
  const auto pose_near = [&](double share) {
    const Pose stated{truth.rotation.slerp(share, other->world_from_probe.rotation), {700, 0, 2000}};
    return probe_pose(station.rig, station.readings, {.near = NearPose{stated, "station door_6"}});
  };
  const auto one = pose_near(0.3), none = pose_near(0.4), neither = pose_near(0.5), another = pose_near(0.7);
  ASSERT_TRUE(one && another);
  EXPECT_LT(off_mm(one->world_from_probe, truth), 1e-4);
  EXPECT_LT(off_mm(another->world_from_probe, other->world_from_probe), 1e-4);
  EXPECT_NEAR(one->choice->turn_rad, 0.3 * one->choice->to_other_rad, 1e-5);
  ASSERT_TRUE(!none && !neither);
  EXPECT_THAT(none.error().message, HasSubstr("station door_6 does not decide between them"));
  EXPECT_THAT(neither.error().message, HasSubstr("station door_6 does not decide between them"));
}

TEST(ProbePose, WhatThePixelsTellIsNotAskedOfAStatedPose) {
  const MadeStation station = make_station({.leds = 6, .trackers = 1});
  const Pose elsewhere{rotation_from_vector({0, 2, 0}), {0, 900, 2000}};
  const auto found = probe_pose(station.rig, station.readings, {.near = NearPose{elsewhere, "station door_6"}});
  ASSERT_TRUE(found) << found.error().message;
  EXPECT_FALSE(found->choice);
  EXPECT_LT(off_mm(found->world_from_probe, station.world_from_probe), 1e-5);
}

TEST(ProbePose, AFlatLayoutFarFromOneTrackerIsAmbiguous) {
  const MadeStation far = make_station({.leds = 5, .trackers = 1, .distance_mm = 6000, .sigma_px = 0.3, .flat = true});
  EXPECT_THAT(probe_pose(far.rig, far.readings).error().message, HasSubstr("explain the LEDs' pixels alike"));
  const MadeStation near =
      make_station({.leds = 5, .trackers = 1, .distance_mm = 1200, .sigma_px = 0.02, .flat = true});
  const auto found = probe_pose(near.rig, near.readings);
  ASSERT_TRUE(found) << found.error().message;
  EXPECT_LT(off_mm(found->world_from_probe, near.world_from_probe), 1e-4);
}

// 12.592 is the 95 % quantile of chi-square with six degrees of freedom.
TEST(ProbePose, CovarianceCoversTheError) {
  for (const int trackers : {1, 2, 4}) {
    const MadeStation station = make_station({.leds = 6, .trackers = trackers});
    std::mt19937 random(11);
    constexpr int kTrials = 500;
    int inside = 0, left_out = 0;
    double chi_square = 0;
    for (int trial = 0; trial < kTrials; ++trial) {
      const auto found = probe_pose(station.rig, with_noise(station.readings, random));
      ASSERT_TRUE(found) << found.error().message;
      const Vector6d step = local_step(station.world_from_probe, found->world_from_probe);
      inside += step.dot(found->covariance.inverse() * step) < 12.592;
      chi_square += found->chi_square / found->redundancy;
      left_out += found->redundancy < 12 * trackers - 6;
    }
    EXPECT_NEAR(inside / double(kTrials), 0.95, 0.03) << trackers;
    EXPECT_NEAR(chi_square / kTrials, 1, 0.05) << trackers;
    EXPECT_LE(left_out, 10) << trackers;
  }
}

TEST(ProbePose, WrongIdsAreLeftOut) {
  std::mt19937 random(5);
  for (const int trackers : {1, 2, 4}) {
    const MadeStation station = make_station({.leds = 8, .trackers = trackers});
    for (int trial = 0; trial < 50; ++trial) {
      LedReadings readings = with_noise(station.readings, random);
      LedReading& wrong = readings[random() % readings.size()];
      const std::size_t a = random() % 8, b = (a + 1 + random() % 7) % 8;
      std::swap(wrong.view.pixels[a], wrong.view.pixels[b]);
      const auto found = probe_pose(station.rig, readings);
      ASSERT_TRUE(found) << trackers << " " << trial << " " << found.error().message;
      const Vector6d step = local_step(station.world_from_probe, found->world_from_probe);
      EXPECT_LT(step.dot(found->covariance.inverse() * step), 40) << trackers << " " << trial;
      for (const LedResidual& residual : found->residuals) {
        const bool swapped = residual.sensor == wrong.view.sensor && (residual.led == a || residual.led == b);
        EXPECT_FALSE(swapped && residual.used) << trackers << " " << trial;
      }
    }
  }
}

TEST(ProbePose, RefusesByName) {
  MadeStation station = make_station({.leds = 4, .trackers = 1});
  std::swap(station.readings[0].view.pixels[0], station.readings[0].view.pixels[1]);
  EXPECT_FALSE(probe_pose(station.rig, station.readings));  // four LEDs, one tracker: nobody can tell which is wrong
  station = make_station({.leds = 2});
  EXPECT_THAT(probe_pose(station.rig, station.readings).error().message, HasSubstr("needs three"));
  EXPECT_THAT(paper_pose(station.rig, station.readings).error().message, HasSubstr("needs three"));
  station = make_station({.leds = 4});
  for (std::size_t i = 0; i < 4; ++i) station.rig.leds[i].position_mm = {20.0 * double(i), 0, 0};
  EXPECT_THAT(probe_pose(station.rig, station.readings).error().message, HasSubstr("on a line"));
  station = make_station({.leds = 3, .trackers = 3});
  for (std::size_t i = 0; i < 3; ++i) {  // one LED each
    LedReading& reading = station.readings[i];
    reading = {{reading.view.sensor, {i}, {reading.view.pixels[i]}, {}}, {reading.covariances_px2[i]}};
  }
  EXPECT_THAT(probe_pose(station.rig, station.readings).error().message, HasSubstr("two trackers the same three"));
  station = make_station({});
  station.readings[0].view.sensor = 0;
  EXPECT_THAT(probe_pose(station.rig, station.readings).error().message, HasSubstr("no camera fixed to the world"));
  station = make_station({});
  station.readings[0].view.pixels[0].x() = std::nan("");
  EXPECT_THAT(probe_pose(station.rig, station.readings).error().message, HasSubstr("not sound"));
}

}  // namespace
}  // namespace crumple
