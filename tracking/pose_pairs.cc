#include "tracking/pose_pairs.h"

#include <utility>

namespace crumple {

PairedStreams::PairedStreams(PoseStream hand, PoseStream eye)
    : hand_(std::move(hand)), eye_(std::move(eye)), hand_is_denser_(hand_.median_step_s() <= eye_.median_step_s()) {}

std::optional<PosePair> PairedStreams::pair(std::size_t index, double offset_s) const {
  const StampedPose& own = sparser().poses()[index];
  const auto other = hand_is_denser_ ? hand_.at(own.time_s + offset_s) : eye_.at(own.time_s - offset_s);
  if (!other) return std::nullopt;
  PosePair pair;
  if (hand_is_denser_) {
    pair.time_s = own.time_s;
    pair.board_from_eye = own.fixed_from_moving;
    pair.world_from_hand = other->fixed_from_moving;
    pair.hand_rate = other->rate;
  } else {
    pair.time_s = own.time_s - offset_s;
    pair.world_from_hand = own.fixed_from_moving;
    pair.board_from_eye = other->fixed_from_moving;
    // A later offset looks at the eye earlier.
    pair.eye_rate = {-other->rate.angular_rad_s, -other->rate.linear_mm_s};
  }
  return pair;
}

}  // namespace crumple
