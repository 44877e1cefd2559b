// Everything a calibration estimates, as one value.
#pragma once

#include <cstddef>
#include <vector>

#include "solvers/board.h"
#include "solvers/pose.h"
#include "solvers/rig.h"

namespace crumple {

struct CalibrationState {
  Rig rig;
  std::vector<Board> boards;           // warp and scale are estimated, the marked points are given
  std::vector<Pose> world_from_board;  // one per placement
  std::vector<std::size_t> board_of;   // the board each placement is of
  // One per station of a probe that is moved about; empty where it stands still and its frame is the world's.
  std::vector<Pose> world_from_probe = {};

  const Board& board_at(std::size_t placement) const { return boards[board_of[placement]]; }
};

}  // namespace crumple
