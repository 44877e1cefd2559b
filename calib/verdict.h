// Is a calibration to be trusted? A verdict with reasons a person can act on.
//
// suspect where: a view's accepted residuals are more than 2.5 times what its group's sigma leads to expect, or more
// than a quarter of its observations were outliers, or (corners and features) three or more were, and all its residuals
// together are more than 4 times that; a group lost more than 5 % of its observations, or was too small for a sigma of
// its own; fewer than five placements, or tilts that span less than 20 degrees; a focal length less certain than 1 %;
// an information matrix with a condition above 1e9 whose weakest direction no weak prior holds (it is named).
//
// Of a calibration that went on from an earlier rig the numbers of boards and tilts do not count, but it is suspect
// where what it found contradicts that rig (once in 10,000 times by chance), or scatters three times as much.
//
// With the data at hand also where an alternative to the model explains the residuals better (calib/alternatives.h), or
// a tracker was moved by more than such a test reaches (calib/moved_sensor.h), or no observation lies in a ninth of a
// camera's image, or of the panel that a camera sees, and what is seen there is not known to a pixel
// (calib/unseen_parts.h; noted where it is known three times worse than elsewhere, and of trackers), or the pitch of a
// board without a certificate, measured by bars or certified boards, is not the stated one: by more than four of its
// standard uncertainties and by 0.5 %, which is more than printers make (noted from 0.05 % on).
//
// With cross-validation also where leaving out some of the views changes the result by more than twice what its
// uncertainty says (calib/fold_differences.h).
//
// Noted, without being suspect: lens terms that only a weak prior holds. What the calibration predicts within the
// observations' reach does not depend on them, but their values mean nothing. And boards whose size nothing could
// contradict: a wrong pitch would not show. And boards without a certificate that nothing ties to bars or certified
// boards. And residuals that form a pattern over an image (calib/regional_tests.h); a measuring volume that boards
// covered less than half of, or that is shallow (calib/volume_coverage.h); a scale whose uncertainty is unknown or not
// complete; the lenses that no richer model would describe better.
//
// rejected where numbers are to be used by nobody: a lens whose focal length is not known to 10 %, views beyond the
// noise where a quarter or more of all views are such.
#pragma once

#include <string>
#include <vector>

#include "calib/calibrate.h"

namespace crumple {

struct Verdict {
  bool ok = true;
  bool rejected = false;
  std::vector<std::string> reasons;  // why not; empty where ok
  std::vector<std::string> notes;    // what to know all the same
};

// "ok", "suspect" or "rejected".
std::string level_of(const Verdict& verdict);

Verdict judge(const Calibration& calibration);
// With what the observations themselves say. `data` is what was calibrated.
Verdict judge(const CalibrationData& data, const Calibration& calibration, int threads);

}  // namespace crumple
