// Poses of a hand and of the eye it carries, at the same instants.
#pragma once

#include <optional>
#include <vector>

#include "tracking/pose_stream.h"

namespace crumple {

// The rates say how each pose changes with the time offset between two streams: zero for the one that is taken at its
// own stamps, and for both where the poses came as pairs.
struct PosePair {
  double time_s = 0;  // on the eye's clock; of pairs without times, their number
  Pose world_from_hand;
  Pose board_from_eye;
  PoseRate hand_rate;
  PoseRate eye_rate;
};

// hand and eye's streams and what belongs together at an offset: hand time = eye time + offset. Pairs stand at the
// stamps of the sparser stream; the other one is interpolated.
class PairedStreams {
 public:
  PairedStreams(PoseStream hand, PoseStream eye);

  // How many there may be: the sparser stream's poses.
  std::size_t size() const { return sparser().poses().size(); }

  // None where the other stream has a gap or has ended.
  std::optional<PosePair> pair(std::size_t index, double offset_s) const;

  const PoseStream& hand() const { return hand_; }
  const PoseStream& eye() const { return eye_; }

 private:
  const PoseStream& sparser() const { return hand_is_denser_ ? eye_ : hand_; }

  PoseStream hand_;
  PoseStream eye_;
  bool hand_is_denser_;
};

}  // namespace crumple
