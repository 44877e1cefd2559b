// Whether the probe, and every tracker, stood still between readings of the LEDs: before and after the scan, and within
// it. Spots are compared where they are measured, in pixels, so no calibration enters.
//
// Each LED of each sensor that was read at least twice is tested against the mean of its readings, weighted by their
// covariances: the sum of the whitened squares is chi-square of 2 (readings - 1) degrees of freedom per LED if nothing
// moved and the covariances are right.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "tracking/led_reading.h"

namespace crumple {

struct LedMotion {
  std::size_t sensor = 0;
  std::size_t led = 0;
  int readings = 0;
  double largest_px = 0;  // between any two of its readings
  double chi_square = 0;  // of 2 (readings - 1)
};

struct Stillness {
  std::vector<LedMotion> leds;  // those read at least twice, by sensor and LED
  double chi_square = 0;
  int degrees = 0;
  double probability =
      1;              // of a chi-square as large or larger with nothing moving; 1 where there is nothing to compare
  double rms_px = 0;  // distance of a reading from its LED's mean
  double largest_px = 0;
  bool still = true;  // probability at or above the limit

  // Whether there was anything to compare: some LED was read at least twice by a sensor.
  bool tested() const { return degrees > 0; }
};

Stillness stillness(const std::vector<LedReadings>& times, double least_probability = 1e-4);

// Stations of one capture at which something moved, by their indices, where no rig says what trackers' pixels repeat
// to. Air and tripods let readings differ by more than their covariances say, at all stations alike: by how much they
// do at the stiller half, chi-square over its degrees of freedom, is taken for noise. A station alone has its
// covariances.
std::vector<std::size_t> moved_stations(const std::vector<Stillness>& stations, double least_probability = 1e-4);

// Of a station that was not still, behind its name: how far something moved, and what to do.
std::string moved_text(const Stillness& moved);

}  // namespace crumple
