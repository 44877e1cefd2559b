#include "tracking/pose_pairs.h"

#include <gtest/gtest.h>

#include "tests/tracking/made_hand_eye.h"

namespace crumple {
namespace {

// Both poses' rates against differences of the pair at two offsets.
void expect_rates(const PairedStreams& streams) {
  const double offset_s = 0.1037, h = 1e-5;
  const std::size_t index = streams.size() / 2;
  const auto pair = streams.pair(index, offset_s), before = streams.pair(index, offset_s - h),
             after = streams.pair(index, offset_s + h);
  ASSERT_TRUE(pair && before && after);
  const Vector6d hand = local_step(before->world_from_hand, after->world_from_hand) / (2 * h);
  const Vector6d eye = local_step(before->board_from_eye, after->board_from_eye) / (2 * h);
  EXPECT_GT(hand.norm() + eye.norm(), 1);
  EXPECT_LT((hand.head<3>() - pair->hand_rate.angular_rad_s).norm(), 1e-6);
  EXPECT_LT((hand.tail<3>() - pair->hand_rate.linear_mm_s).norm(), 1e-4);
  EXPECT_LT((eye.head<3>() - pair->eye_rate.angular_rad_s).norm(), 1e-6);
  EXPECT_LT((eye.tail<3>() - pair->eye_rate.linear_mm_s).norm(), 1e-4);
}

TEST(PosePairs, RatesSayHowPosesChangeWithTheOffset) {
  std::mt19937 random(1);
  const MadeStreams made = make_streams({.offset_s = 0.1}, random);
  const auto hand = PoseStream::create(made.hand), eye = PoseStream::create(made.eye);
  ASSERT_TRUE(hand && eye);
  expect_rates({*hand, *eye});
  expect_rates({*eye, *hand});
}

TEST(PosePairs, StandAtTheSparserStreamsStamps) {
  std::mt19937 random(2);
  const MadeStreams made = make_streams({.offset_s = 0.1}, random);
  const PairedStreams streams(*PoseStream::create(made.hand), *PoseStream::create(made.eye));
  EXPECT_EQ(streams.size(), made.eye.size());
  EXPECT_EQ(streams.pair(7, 0.1)->time_s, made.eye[7].time_s);
  EXPECT_FALSE(streams.pair(0, -5));
}

}  // namespace
}  // namespace crumple
