// The chain of rigid motions from what a sensor sees to the sensor.
//
//   a board      sensor_from_mount (world_from_probe^-1) world_from_board     the probe's pose where the sensor is on
//   it the probe    sensor_from_mount world_from_probe                           seen by a sensor fixed to the world
//   the room     sensor_from_mount world_from_probe^-1                        seen by a sensor on the probe
//
// With the derivatives of its tangent by the tangents of its links (solvers/pose.h).
#pragma once

#include <cstddef>
#include <optional>

#include "solvers/state.h"

namespace crumple {

struct SensorChain {
  Pose pose;           // sensor_from_board, sensor_from_probe or sensor_from_world
  Matrix6d d_mount;    // by sensor_from_mount
  Matrix6d d_station;  // by world_from_probe; where there is a station
  Matrix6d d_board;    // by world_from_board; of boards
};

// `station`: where the probe that carries the sensor is; none for a sensor fixed to the world and for a probe that
// stands still.
SensorChain sensor_from_board(const CalibrationState& state, std::size_t sensor, std::size_t placement,
                              std::optional<std::size_t> station);
Pose sensor_from_board_pose(const CalibrationState& state, std::size_t sensor, std::size_t placement,
                            std::optional<std::size_t> station);

// `station` as LedView::station. What carries the LEDs is the probe for a sensor fixed to the world, and the world for
// one on the probe; without a station both are fixed to the world.
SensorChain sensor_from_leds(const CalibrationState& state, std::size_t sensor, std::optional<std::size_t> station);

}  // namespace crumple
