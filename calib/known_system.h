// What is known so far of a tracked system, and how it spreads over the graph of who sees what: stations from LEDs,
// placements from stations, stations from placements, moved trackers and LEDs from both. For whatever starts a
// calibration: closed forms (calib/initial_system.h) or an earlier rig (calib/start_from_rig.h).
#pragma once

#include <cstddef>
#include <map>
#include <optional>
#include <set>
#include <utility>

#include <Eigen/Core>

#include "calib/calibration_data.h"
#include "solvers/expected.h"

namespace crumple {

using BoardSighting = std::pair<std::size_t, std::optional<std::size_t>>;  // placement and station

struct KnownSystem {
  CalibrationState state;  // its poses are not in use before settled()
  std::map<BoardSighting, Pose> probe_from_board;
  std::map<std::size_t, Pose> world_from_board;        // by placement
  std::map<std::size_t, Pose> world_from_leds;         // by station; the LEDs' own frame
  std::map<std::size_t, Pose> world_from_probe;        // by station
  std::map<std::size_t, Eigen::Vector3d> led_in_leds;  // by LED, in the LEDs' frame
  std::set<std::size_t> located;                       // LEDs whose place on their mount is in the state
  // Trackers that are not posed in the world yet: of later set-ups, and those that were calibrated apart until LEDs
  // join them (calib/join_trackers.h).
  std::set<std::size_t> moved_trackers;
};

// Sensors, boards, LEDs in their places, nothing known of them yet.
Expected<KnownSystem> nothing_known(const CalibrationData& data);

// Trackers that were moved have the lenses of where they stood before, and are yet to be posed.
void share_lenses(KnownSystem& known);

// Of the LEDs that two sensors or more see at a station (without one, of the room's): in the world.
std::map<std::size_t, Eigen::Vector3d> triangulated_leds(const CalibrationData& data, const KnownSystem& known,
                                                         std::optional<std::size_t> station);

// Spreads what is known until nothing new is, and gives the state. Errors name what is not connected.
Expected<CalibrationState> settled(const CalibrationData& data, KnownSystem known);

}  // namespace crumple
