// The pose of one board from its corners, the sensors that see it being known.
#pragma once

#include <vector>

#include "solvers/expected.h"
#include "solvers/observations.h"
#include "solvers/state.h"

namespace crumple {

// Least squares from `start` (probe_from_board) over the corners that all the cameras see of one placement. Fails where
// a corner cannot be predicted at the start, and where the corners do not determine a pose.
Expected<Pose> fit_board_pose(const Rig& rig, const Board& board, const std::vector<CornerView>& views,
                              const Pose& start);

}  // namespace crumple
