// The probe's LEDs as one rigid body, before anything is known of the probe: at each station those that two trackers
// see are triangulated; the station with most of them gives the LEDs a frame (its origin in their middle, its axes the
// world's), the others are fitted to it (solvers/closed_form/rigid_fit.h) and add those it lacks.
#pragma once

#include "calib/known_system.h"
#include "solvers/expected.h"

namespace crumple {

// Adds where LEDs are in their frame, and that frame at every station that shows three of them. Where nothing can be
// triangulated, but the probe looks at boards, a single tracker poses board, stations and LEDs instead
// (calib/one_tracker.h). Fails where neither is possible.
Expected<void> build_constellation(const CalibrationData& data, KnownSystem& known);

}  // namespace crumple
