// Which motions the closed form of a hand-eye pose is computed from.
//
// Of many poses, up to sixty that lie far apart in the hand's rotation (each next one is the furthest from those
// chosen). Of all motions between them, those that turn by at most 160 degrees (at a half turn an axis has no sign) and
// in which hand and eye agree: a rigid motion has the same angle of rotation in both frames, and the same shift along
// its axis (M. Chen's two invariants, ICCV 1991: the screw's pitch). What lies beyond five robust sigmas (1.4826 times
// the median of the absolute differences) is left out. Of these up to 200, greedily: each next one is the one that
// makes the determinant of the translation's information matrix, sum 4 sin^2(angle / 2) (I - n n'), grow most
// (D-optimality), which wants large rotations and different axes.
#pragma once

#include <vector>

#include "solvers/closed_form/hand_eye.h"
#include "tracking/pose_pairs.h"

namespace crumple {

struct SelectedMotions {
  std::vector<HandEyeMotion> motions;
  std::size_t candidates = 0;     // motions between the chosen poses
  std::size_t contradictory = 0;  // of them: hand and eye do not agree
};

SelectedMotions select_motions(const std::vector<PosePair>& pairs);

}  // namespace crumple
