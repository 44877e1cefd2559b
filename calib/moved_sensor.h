// Was a tracker moved half-way through a campaign? Then no mount of its own fits what it saw before and after.
//
// For each sensor fixed to the world and each time between two stations, the mount is fitted before and after by
// itself, linearised at the refinement, to the residuals of the LEDs; the split that explains most is refined in full,
// as a tracker with two places (solvers/rig.h, lens_of). It counts as moved where that takes away more than half of the
// LEDs' sum of squares, outliers included, and the two places differ by more than five standard uncertainties.
#pragma once

#include <optional>
#include <string>

#include "calib/calibrate.h"

namespace crumple {

struct MovedSensor {
  std::size_t sensor = 0;
  std::size_t first_station = 0;     // at its new place
  Vector6d step = Vector6d::Zero();  // of its mount, rad and mm
  std::string sentence;
};

// None where nothing was, and where LEDs are not seen from three stations on both sides. Stations in the order of their
// numbers are taken to be in that of time.
std::optional<MovedSensor> find_moved_sensor(const CalibrationData& data, const Calibration& calibration, int threads);

}  // namespace crumple
