#include "tracking/pose_stream.h"

#include <cmath>
#include <limits>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace crumple {
namespace {

const Eigen::Vector3d kRate_rad_s(0.3, -0.2, 0.5);

std::vector<StampedPose> even_motion() {
  std::vector<StampedPose> poses;
  for (int i = 0; i <= 20; ++i) {
    const double t = 0.1 * i;
    poses.push_back({t, {rotation_from_vector(t * kRate_rad_s), Eigen::Vector3d(100 * t, 5, -20 * t)}});
  }
  return poses;
}

TEST(PoseStream, FollowsEvenMotionBetweenThePoses) {
  const auto stream = PoseStream::create(even_motion());
  ASSERT_TRUE(stream) << stream.error().message;
  for (const double t : {0.0, 0.034, 0.1, 1.27, 2.0}) {
    const auto pose = stream->at(t);
    ASSERT_TRUE(pose) << t;
    const Pose truth{rotation_from_vector(t * kRate_rad_s), {100 * t, 5, -20 * t}};
    EXPECT_LT(local_step(pose->fixed_from_moving, truth).norm(), 1e-12) << t;
    EXPECT_LT((pose->rate.angular_rad_s - kRate_rad_s).norm(), 1e-12);
    EXPECT_LT((pose->rate.linear_mm_s - Eigen::Vector3d(100, 0, -20)).norm(), 1e-10);
  }
  EXPECT_FALSE(stream->at(-0.01));
  EXPECT_FALSE(stream->at(2.01));
}

TEST(PoseStream, TakesTheShorterWayBetweenQuaternionsOfEitherSign) {
  std::vector<StampedPose> poses = even_motion();
  for (std::size_t i = 1; i < poses.size(); i += 2) poses[i].fixed_from_moving.rotation.coeffs() *= -1;
  const auto stream = PoseStream::create(poses);
  ASSERT_TRUE(stream);
  EXPECT_LT((stream->at(0.55)->rate.angular_rad_s - kRate_rad_s).norm(), 1e-12);
}

TEST(PoseStream, SaysNothingInAGap) {
  std::vector<StampedPose> poses = even_motion();
  poses.erase(poses.begin() + 8, poses.begin() + 12);
  const auto stream = PoseStream::create(poses);
  ASSERT_TRUE(stream);
  EXPECT_FALSE(stream->at(0.95));
  EXPECT_TRUE(stream->at(0.65));
  EXPECT_TRUE(stream->at(1.25));
}

TEST(PoseStream, KeepsTheFirstOfPosesWithOneTime) {
  std::vector<StampedPose> poses = even_motion();
  poses.insert(poses.begin() + 4, poses[3]);
  const auto stream = PoseStream::create(poses);
  ASSERT_TRUE(stream);
  EXPECT_EQ(stream->repeated(), 1U);
  EXPECT_EQ(stream->poses().size(), 21U);
}

TEST(PoseStream, RefusesWhatIsNoStream) {
  std::vector<StampedPose> poses = even_motion();
  std::swap(poses[3], poses[4]);
  EXPECT_THAT(PoseStream::create(poses).error().message, testing::HasSubstr("pose 5 is older"));
  poses = even_motion();
  poses[2].fixed_from_moving.translation.x() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(PoseStream::create(poses).error().message, testing::HasSubstr("pose 3"));
  poses[2].fixed_from_moving = {Eigen::Quaterniond(0, 0, 0, 0), {1, 2, 3}};
  EXPECT_FALSE(PoseStream::create(poses));
  EXPECT_FALSE(PoseStream::create({}));
  EXPECT_FALSE(PoseStream::create({{1, {}}, {1, {}}}));
}

}  // namespace
}  // namespace crumple
