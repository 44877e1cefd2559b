// Everything a calibration estimates, as one value.
#pragma once

#include <vector>

#include "solvers/board.h"
#include "solvers/pose.h"
#include "solvers/rig.h"

namespace crumple {

struct CalibrationState {
  Rig rig;
  Board board;                         // its warp is estimated, its corner grid is given
  std::vector<Pose> probe_from_board;  // one per placement
};

}  // namespace crumple
