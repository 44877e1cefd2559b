// Where an eye sits on the hand that carries it, from poses of both: tracker or arm on one side, a camera that sees a
// board on the other. X = hand_from_eye and world_from_board such that
//   world_from_hand X = world_from_board board_from_eye   for every pair.
//
// Two streams: the clocks' offset from angular rates (tracking/time_offset.h), poses paired by interpolation, motions
// chosen for conditioning (tracking/motion_selection.h), the closed form (solvers/closed_form/hand_eye.h), then the
// refinement over all pairs (tracking/hand_eye_refinement.h). Pairs that are given as such skip the first two.
//
// Refused by name: rotations too small or about parallel axes for the noise that the poses show; an offset that angular
// rates do not tell.
#pragma once

#include <optional>
#include <vector>

#include "solvers/expected.h"
#include "tracking/board_scatter.h"
#include "tracking/hand_eye_refinement.h"
#include "tracking/motion_selection.h"
#include "tracking/time_offset.h"

namespace crumple {

struct HandEyeCalibration {
  HandEyeFit fit;
  HandEyeStart start;                // of the closed form
  std::size_t motions = 0;           // it was computed from
  std::optional<TimeOffset> offset;  // as the angular rates tell it; of streams
  BoardScatter scatter;              // of the accepted pairs
  BoardScatter scatter_all;          // of all pairs
};

Expected<HandEyeCalibration> calibrate_hand_eye(const std::vector<PosePair>& pairs);
Expected<HandEyeCalibration> calibrate_hand_eye(const PairedStreams& streams);

}  // namespace crumple
