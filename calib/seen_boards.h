// Where cameras saw boards.
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "calib/calibration_data.h"

namespace crumple {

// The first camera that saw one: of those on the probe, where there are none of those in the world.
std::optional<std::size_t> first_board_camera(const Observations& observations, const Rig& rig);

// The distances from a camera, along its axis, at which it saw the middles of boards; ascending.
std::vector<double> board_depths_mm(const CalibrationData& data, const CalibrationState& state, std::size_t camera);

// Of the box around the marked points, on the sheet.
Eigen::Vector3d board_centre(const Board& board);

bool in_image(const Lens& lens, const Eigen::Vector2d& pixel);

}  // namespace crumple
