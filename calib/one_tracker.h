// The start where a single tracker watches the LEDs of a probe that looks at a board: nothing can be triangulated, but
// the board tells where the probe is.
//
// The tracker sees LED l of station i at
//   lens(tracker_from_board (board_from_probe_i x_l)),
// with the LED's place x_l in the probe frame and tracker_from_board unknown. Were one LED's place known, its path over
// the stations would pose the tracker (SQPnP, tracking/pose_starts.h), and with that the other LEDs' places are a
// linear problem. So that is done for places all over a cube of 1.2 m about the probe, and from the few that fit best
// all is refined by least squares of slopes. No layout of the LEDs has to be known.
#pragma once

#include <cstddef>
#include <map>
#include <vector>

#include <Eigen/Core>

#include "solvers/expected.h"
#include "solvers/lens.h"
#include "solvers/pose.h"

namespace crumple {

struct LedsBeforeBoard {
  Pose board_from_probe;
  std::vector<std::size_t> leds;
  std::vector<Eigen::Vector2d> pixels;
};

struct OneTrackerStart {
  Pose tracker_from_board;
  std::map<std::size_t, Eigen::Vector3d> led_in_probe_mm;  // of those seen from four stations or more
};

// All before the same board placement. Fails with fewer than four stations, and where the fit stays worse than a
// hundredth of slope or does not determine the unknowns.
Expected<OneTrackerStart> one_tracker_start(const Lens& lens, const std::vector<LedsBeforeBoard>& stations);

}  // namespace crumple
