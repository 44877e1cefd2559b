// The start of a tracked system, chained from its parts over the graph of who sees what.
//
//   1. The probe alone: every board at every station is a placement of its own before a probe that stands still;
//      cameras, projectors and boards' poses as in calib/initial_rig.h, refined where asked for.
//   2. The trackers alone, from the boards they see: the same, with the world in place of the probe. Those that share
//      no board placement are calibrated apart, group by group; the largest group stands in the world.
//   3. LEDs: at each station those that two trackers or more see are triangulated (solvers/closed_form/triangulate.h);
//      the station with most of them gives a frame of the LEDs, the others are fitted to it
//      (solvers/closed_form/rigid_fit.h) and add those it lacks. Reference LEDs in the room are triangulated likewise.
//      Where a single tracker watches, LEDs and board are posed by the probe's own poses (calib/one_tracker.h).
//   4. Hand and eye: where trackers and probe see the same board, the pose of the probe's frame in the LEDs' follows
//      directly; otherwise from the motions between stations before the same placement (Horaud & Dornaika,
//      solvers/closed_form/hand_eye.h).
//   5. Trackers that were calibrated apart, by LEDs (calib/join_trackers.h). Where some still wait, 3 and 4 are done
//      again with those that were joined.
//   6. Trackers of later set-ups, whose lenses the first one tells: by the references, LEDs and boards they see.
//   7. LEDs, stations and placements in the frames of probe and world. A station without LEDs is posed by a placement
//      that others know, one with LEDs that do not suffice for step 3 by their pixels (tracking/probe_pose.h).
//
// With the parts not refined these are the closed forms alone; with the parts refined each by itself it is stage by
// stage, as laboratories do it.
//
// Errors name the part that is not connected: a tracker without boards, trackers that neither boards nor LEDs join, a
// station, a placement, too few LEDs, hand-eye motions about one axis.
#pragma once

#include <functional>

#include "calib/calibration_data.h"

namespace crumple {

// A part of the system calibrated by itself: of its sensors, in the order given, with its placements.
using CalibratePart = std::function<Expected<CalibrationState>(const CalibrationData& part)>;

// `calibrate_part` solves parts 1 and 2; their placements carry names that say which board and station they are.
Expected<CalibrationState> initial_system(const CalibrationData& data, const CalibratePart& calibrate_part);

}  // namespace crumple
