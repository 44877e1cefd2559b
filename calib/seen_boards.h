// Where cameras saw boards.
#pragma once

#include <vector>

#include "calib/calibration_data.h"

namespace crumple {

// The distances from a camera, along its axis, at which it saw the middles of boards; ascending.
std::vector<double> board_depths_mm(const CalibrationData& data, const CalibrationState& state, std::size_t camera);

// Of the box around the marked points, on the sheet.
Eigen::Vector3d board_centre(const Board& board);

bool in_image(const Lens& lens, const Eigen::Vector2d& pixel);

}  // namespace crumple
