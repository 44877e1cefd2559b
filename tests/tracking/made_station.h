// A made probe with LEDs before trackers, and what these see of it.
#pragma once

#include <random>
#include <string>

#include "solvers/rig.h"
#include "tracking/led_reading.h"

namespace crumple {

struct MadeStationOptions {
  int leds = 8;
  int trackers = 3;
  double distance_mm = 3000;
  double sigma_px = 0.05;
  bool flat = false;  // all LEDs on one plane
};

struct MadeStation {
  Rig rig;
  Pose world_from_probe;
  LedReadings readings;  // exact, with the covariance of sigma_px
};

// The probe turned by `turn_rad` about the world's y axis, all LEDs in sight of all trackers, which stand 1 m apart.
MadeStation make_station(const MadeStationOptions& options, double turn_rad = 0.3);

// Pixels with noise of their covariance.
LedReadings with_noise(const LedReadings& readings, std::mt19937& random);

}  // namespace crumple
