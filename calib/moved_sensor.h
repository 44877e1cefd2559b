// Was a tracker moved half-way through a campaign? Then no mount of its own fits what it saw before and after.
//
// For each tracker and each time between two stations the score test (solvers/score_test.h) tells what two places would
// explain; the best one's time is taken. There every tracker is refined in full as one with two places (solvers/rig.h,
// lens_of; the six most likely ones, of which one may have several times there), and so is every camera on the probe,
// which looks alike where it came loose. Boards that the probe saw on one side of that time alone were seen by trackers
// then; for boards and references that were seen nobody knows when, such as boards shown to the trackers alone, the
// tracker has a third place. Where these are references that do not tell a third place, such as a bar's two, its
// readings of them are left out.
//
// A sensor counts as moved where that takes away more than three quarters of the sum of squares of the LEDs that are
// then accepted, nine tenths of all at the least, and the two places differ by more than five standard uncertainties.
// Of several the one with the largest likelihood is found, with those whose logarithm of it is less by 15 at the most,
// or by a thirtieth of the gain: two trackers alone see only that they moved against each other. A tracker that read
// LEDs from too few stations on one side to be refined is among these where the score test gains as much by it.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "calib/calibrate.h"

namespace crumple {

struct MovedSensor {
  std::size_t sensor = 0;
  std::size_t first_station = 0;          // at its new place
  Vector6d step = Vector6d::Zero();       // of its mount, rad and mm
  std::vector<std::size_t> or_else = {};  // sensors of which one may have moved in its place, trackers or not
  std::string sentence;
};

// How far a sensor's own centre is from where it was, in the frame of its mount, and how far it turned: unlike the
// tangent of sensor_from_mount, it does not depend on where that frame has its origin.
struct SensorStep {
  SensorStep() = default;
  SensorStep(const Sensor& before, const Sensor& after);

  double place_mm = 0;
  double turn_rad = 0;
};

// "track1 stood elsewhere from station door_4 on (by 1.2 mm and 0.09 deg)".
std::string moved_clause(const std::string& sensor, const std::string& first_station, const SensorStep& step);

// A tracker. None where nothing was moved, where a camera on the probe was and no tracker explains nearly as much, and
// where LEDs are not seen from three stations on both sides. Stations in the order of their numbers are taken to be in
// that of time.
std::optional<MovedSensor> find_moved_sensor(const CalibrationData& data, const Calibration& calibration, int threads);

}  // namespace crumple
