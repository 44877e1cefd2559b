// Where a board stands before a sensor whose lens is known: its homography to the rays of what is seen of it.
#pragma once

#include <optional>

#include "solvers/closed_form/homography.h"
#include "solvers/lens.h"
#include "solvers/pose.h"

namespace crumple {

// sensor_from_board, the board in front. None where fewer than four points have a ray ahead, or three of four are on a
// line.
std::optional<Pose> board_pose(const Lens& lens, const Points2d& plane_mm, const Points2d& pixels);

}  // namespace crumple
