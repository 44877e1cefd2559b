// How far the clocks of two pose streams are apart whose moving bodies are rigidly joined.
//
// Two joined bodies turn by the same angle in the same time, wherever they sit on each other and whatever frames they
// are reported in. So the angle turned within a window of time is one and the same signal in both streams, and the
// offset of the clocks is where the two signals correlate best (Pearson's coefficient, over the times that both have).
// Found on a grid over all offsets at which the streams overlap by half of the shorter one, then refined below the grid
// by least squares on the difference of the signals.
//
// Degenerate where the angular rate does not vary, and doubtful where another offset correlates nearly as well (a
// periodic motion): measured and refused.
#pragma once

#include "solvers/expected.h"
#include "tracking/pose_stream.h"

namespace crumple {

struct TimeOffset {
  double offset_s = 0;  // time on a's clock = time on b's clock + offset
  double sigma_s = 0;
  double correlation = 0;        // there
  double rival_correlation = 0;  // the best of the peaks further away than the signals' own width
};

Expected<TimeOffset> estimate_time_offset(const PoseStream& a, const PoseStream& b);

}  // namespace crumple
