// A made tracked system and what it observes, with noise but without images: a probe with a camera, a projector and
// LEDs is moved about before boards, trackers see the LEDs, and a larger board is shown to the trackers alone.
//
// World frame: that of the first tracker, z forward, y down. Sensors: "cam0", "proj0" (where asked for), "track0", ...;
// with a second pair "cam0", "cam1", "proj0", "proj1", "track0", ...
// Boards: 0 for the probe, 1 for the trackers. Placements: first the probe's, then the trackers'.
#pragma once

#include "solvers/observations.h"
#include "solvers/state.h"

namespace crumple {

struct MadeSystemOptions {
  int trackers = 2;
  ImageSize tracker_size{1024, 768};
  double tracker_focal_px = 1400;
  double tracker_baseline_mm = 1000;
  double tracker_distance_mm = 2500;
  int leds = 5;
  double led_spread_mm = 250;
  bool projector = true;
  bool second_pair = false;     // "cam1" and "proj1" too; at every second station proj1 lights the board
  int stations = 20;            // of the probe before a board, taking turns at the placements
  int placements = 1;           // of the probe's board
  int wand_stations = 0;        // LEDs only
  int tracker_placements = 15;  // of the trackers' board
  int room_leds = 0;            // references fixed to the world, seen by all trackers
  double bar_mm = 0;            // a scale bar's length, if there is one: two more references at every place
  int bar_places = 1;
  // Trackers are moved after half of the stations: "track0b", ... share the lenses of "track0", ... and see the second
  // half and the references, but no boards.
  bool moved_trackers = false;
  double turn_deg = 30;   // of the probe about each axis, at most; 0: it is only shifted
  bool one_axis = false;  // turned about the upright axis alone
  double led_sigma_px = 0.05;
  double corner_sigma_px = 0.1;
  double stripe_sigma_px = 0.1;
  unsigned seed = 1;
  void (*change)(Rig&) = nullptr;  // of the true rig, before anything is seen
};

struct MadeSystem {
  CalibrationState truth;
  Observations observations;
};

MadeSystem make_system(const MadeSystemOptions& options);

// The truth pushed away by a fraction of a degree and some mm, lenses by some px, as a start for refinement. What holds
// the gauge stays.
CalibrationState disturbed_system(const CalibrationState& truth, unsigned seed);

}  // namespace crumple
