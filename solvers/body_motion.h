// How the calibration's own errors move the bodies that it saw, on average, in the frame of each mount.
//
// A sensor's frame is not what a user can touch: lens, mount and the poses of everything seen move together without
// changing any residual. What can be touched are the bodies that were observed. So a fixed point of the world is one
// that is fixed to each of them, taken on average (Kogan, mrcal's "Projection uncertainty", 2.2): where the estimated
// pose of body i moves by the small motion m_i, the point moves by m_i, and the average of these is one motion of the
// frame, the mean m_i. It is linear in the poses, and all that lens and mount need beside them to tell where a fixed
// point is projected to (solvers/projection_uncertainty.h). No gauge is left in it: what moves a frame as a whole moves
// its sensors and its bodies alike.
//
// Bodies in the frame of the probe: each board placement at each station that a sensor on the probe saw it from;
// without boards the room's references, at each station. In the world: each board placement that a sensor fixed to the
// world saw; without boards the probe's LEDs at each station, and the room's. Boards where there are any, because the
// pose of a few LEDs is worse known by far and an average would not tell how well the sensors are. Three LEDs that are
// not on a line make a body; fewer are none.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "solvers/covariance.h"
#include "solvers/residuals.h"

namespace crumple {

// "probe.datum_rotation_x" ... "world.datum_translation_z": the rows of the mean motions.
std::vector<std::string> datum_names(Mount mount);

// Six rows for each mount that has sensors and bodies, rad and mm in the mount's frame. `views` are those with accepted
// observations.
TangentFunction mean_body_motions(const std::vector<const View*>& views, const CalibrationState& state);

}  // namespace crumple
