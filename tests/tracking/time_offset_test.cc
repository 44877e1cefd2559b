#include "tracking/time_offset.h"

#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/tracking/made_hand_eye.h"

namespace crumple {
namespace {

struct BothStreams {
  PoseStream hand;
  PoseStream eye;
};

BothStreams streams_of(const MadeStreamsOptions& options, unsigned seed) {
  std::mt19937 random(seed);
  const MadeStreams made = make_streams(options, random);
  return {*PoseStream::create(made.hand), *PoseStream::create(made.eye)};
}

TEST(TimeOffset, FindsAnyOffsetToAFractionOfAStep) {
  for (const double offset_s : {0.0, 0.0123, -0.4321, 3.2017, -1491754390.25}) {
    const BothStreams streams = streams_of({.offset_s = offset_s}, 1);
    const auto found = estimate_time_offset(streams.hand, streams.eye);
    ASSERT_TRUE(found) << found.error().message;
    EXPECT_NEAR(found->offset_s, offset_s, 1e-3);
    EXPECT_GT(found->correlation, 0.99);
  }
}

TEST(TimeOffset, ItsSigmaCoversTheErrorOfNoisyStreams) {
  double squares = 0;
  for (unsigned seed = 1; seed <= 12; ++seed) {
    const BothStreams streams =
        streams_of({.offset_s = 0.25, .hand_sigma_deg = 0.05, .eye_sigma_deg = 0.5, .eye_sigma_mm = 2}, seed);
    const auto found = estimate_time_offset(streams.hand, streams.eye);
    ASSERT_TRUE(found) << found.error().message;
    EXPECT_LT(std::abs(found->offset_s - 0.25), 0.02);
    squares += std::pow((found->offset_s - 0.25) / found->sigma_s, 2) / 12;
  }
  EXPECT_LT(squares, 3);
}

TEST(TimeOffset, RefusesAnEvenTurn) {
  std::vector<StampedPose> poses;
  for (int i = 0; i < 500; ++i)
    poses.push_back({0.02 * i, {rotation_from_vector({0, 0, 0.005 * i}), Eigen::Vector3d::Zero()}});
  const auto stream = PoseStream::create(poses);
  const auto found = estimate_time_offset(*stream, *stream);
  ASSERT_FALSE(found);
  EXPECT_THAT(found.error().message, testing::HasSubstr("angular rate does not vary"));
}

TEST(TimeOffset, RefusesAPeriodicMotion) {
  std::vector<StampedPose> poses;
  for (int i = 0; i < 1500; ++i) {
    poses.push_back({0.02 * i, {rotation_from_vector({0.5 * std::sin(0.04 * i), 0, 0}), Eigen::Vector3d::Zero()}});
  }
  const auto stream = PoseStream::create(poses);
  const auto found = estimate_time_offset(*stream, *stream);
  ASSERT_FALSE(found);
  EXPECT_THAT(found.error().message, testing::HasSubstr("ambiguous"));
}

TEST(TimeOffset, RefusesStreamsOfDifferentBodies) {
  const BothStreams one = streams_of({.seconds = 60}, 1), other = streams_of({.seconds = 60}, 2);
  const auto found = estimate_time_offset(one.hand, other.eye);
  ASSERT_FALSE(found);
  EXPECT_THAT(found.error().message, testing::HasSubstr("cannot be told"));
}

}  // namespace
}  // namespace crumple
