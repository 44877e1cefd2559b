// Priors on lens terms that observations can hardly tell apart. They state no knowledge of the lens: they are so wide
// that the image the observations do determine is not moved, and they keep the terms from growing without limit.
//
//   OPENCV8, OPENCV12   k4 k5 k6 about 0. The denominator can undo the numerator's k1 k2 k3, so each may grow while the
//                       image hardly changes. Sigma: what changes the image radius at the farthest corner by 30 %;
//                       at 100 % the denominator has its zero there.
//   OPENCV12            s1 s2 s3 s4 about 0: 10 % of the radius of the farthest corner.
//   CAHVOR              alpha beta about 0: 0.1 rad. Where the radial terms are small the axis is of no consequence.
//   SPLINED             every control point about 0, in its own radial direction 0.5, across it 0.05 (a lens is nearly
//                       symmetric; mrcal's regularisation does likewise).
//
// Where two sets of terms say exactly the same, a convention chooses, as a prior that is not weak: CAHVOR's r0, which
// scales the image as fx and fy do, stays at its start to 1e-4; the core fx fy cx cy of a splined lens, which the
// control points can take over, to 1e-4 of the focal length. Its control points can turn the image as the sensor's
// rotation does: the mean of the four innermost and their turn about the axis stay at their start to 1e-4.
//
// Sigmas are set at the start of a refinement, from its focal lengths and principal points.
#pragma once

#include <vector>

#include "solvers/prior.h"

namespace crumple {

// Of all sensors; empty where no lens needs one. Named "cam0.weak", "cam0.core" and "cam0.axis".
std::vector<Prior> lens_priors(const CalibrationState& start);

// Weakly, of the whole rig: focal lengths to half of themselves, principal points to a quarter of the image, mounts to
// 1 rad and 2 m, LEDs to 1 m. Where it decides a term, nothing else tells it. Named "rig".
Prior whole_rig_prior(const CalibrationState& start);

}  // namespace crumple
