// The pose of the probe as the reference method has it: markers triangulated, then the rigid motion of least squares,
//
//   minimise  sum |b_i - (q + R (a_i - p))|^2      over R and q,
//
// a_i the LEDs in the probe frame and p their centroid, b_i the triangulated markers in the world. All markers count
// alike, whatever their covariance; that is what the pose from pixels (tracking/probe_pose.h) does better.
#pragma once

#include <cstddef>
#include <vector>

#include "solvers/expected.h"
#include "tracking/led_sighting.h"

namespace crumple {

struct PaperPose {
  Pose world_from_probe;
  std::vector<std::size_t> leds;   // those triangulated, ascending
  std::vector<double> misfits_mm;  // of each, |b - (q + R (a - p))|
  double rms_mm = 0;
};

// LEDs that fewer than two trackers see, or whose rays do not meet, are passed over. Fails with fewer than three left
// and where these lie on a line.
Expected<PaperPose> paper_pose(const Rig& rig, const LedReadings& readings);

}  // namespace crumple
