// A rig in space, to scale: sensors as pyramids of what they see, boards where they were placed, LEDs, and where the
// probe was. The frame is the world's (docs/conventions.md: y points down), or the probe's where it stands still.
#pragma once

#include "datasets/report/gnuplot.h"
#include "solvers/state.h"

namespace crumple {

Plot rig_plot(const CalibrationState& state);

// The same from above: z to the right, x down.
Plot rig_plan(const CalibrationState& state);

}  // namespace crumple
