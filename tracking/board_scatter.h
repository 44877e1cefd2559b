// How well pairs of poses agree on where the board is, with a hand-eye pose known: from every pair the board's origin
// in the world, p_i = world_from_hand hand_from_eye board_from_eye^-1 0, and the board's orientation.
#pragma once

#include <vector>

#include "tracking/pose_pairs.h"

namespace crumple {

struct BoardScatter {
  std::size_t pairs = 0;
  double rms_mm = 0;     // root of the mean of |p_i - mean|^2: a length in space, not per axis
  double median_mm = 0;  // of |p_i - median|, the median taken axis by axis: what few wild poses do not move
  double rms_rad = 0;    // the same of the angle between the orientation and the mean orientation
};

// `accepted` leaves pairs out where it is not empty. Precondition: a pair at least is left.
BoardScatter board_scatter(const std::vector<PosePair>& pairs, const std::vector<char>& accepted,
                           const Pose& hand_from_eye);

}  // namespace crumple
