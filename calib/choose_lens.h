// Which lens model the sensors of a kind want, by the data.
//
// OpenCV's models form a ladder, each with the terms of the one before and some more: PINHOLE, OPENCV4, 5, 8, 12. From
// the bottom up, a model takes the place of the best so far where both hold:
//   significant   the Wald statistic w' C^-1 w of the terms it has more, over all sensors of the kind, exceeds what
//                 lenses without them reach once in a thousand times (chi-square, Wilson & Hilferty's approximation);
//   predictive    it foretells placements that it has not seen better: their mean square residual falls by more than
//                 its standard error over the placements.
// Terms that only a weak prior holds (solvers/undetermined.h) do not speak against a model: what it foretells does not
// depend on them. They are named.
// Held-out residuals come from folds over the placements, five at most: the rig is calibrated without a fold's
// placements, each of these gets its pose from its corners with that rig, and its residuals are taken. Outliers of the
// richest model that could be fitted are left out for all. Cameras are compared by their corners alone, then projectors
// by stripes and projected features, with the cameras' model chosen already.
// Of a tracked system the probe's sensors and the trackers are judged each by themselves (calib/system_part.h): the
// trackers by the boards they see.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "calib/calibrate.h"

namespace crumple {

struct LensCandidate {
  std::string model;
  bool fitted = false;  // where not, only the reason says anything
  double rms_px = 0;    // of the fit, per observation, outliers of the richest model left out
  double held_out_rms_px = 0;
  std::string against;                    // the best model before it; empty for the first
  double statistic = 0;                   // Wald, of its further terms
  double statistic_limit = 0;             // above: significant
  double gain_px2 = 0;                    // fall of the mean square held-out residual
  double gain_sigma_px2 = 0;              // its standard error
  std::vector<std::string> undetermined;  // terms
  bool taken = false;                     // it was the best so far when its turn came
  std::string reason;                     // why, in words
};

struct LensChoice {
  SensorKind kind = SensorKind::camera;
  std::optional<Mount> mount = {};  // of a tracked system; else all sensors of the kind
  std::string model;
  std::vector<LensCandidate> candidates;
};

// One choice per kind of sensor there is, cameras first; the trackers' last. Fails where no candidate can be fitted or
// there are too few placements to hold any out. `report` is called after each calibration.
Expected<std::vector<LensChoice>> choose_lenses(const CalibrationData& data, const CalibrationOptions& options,
                                                const std::function<void()>& report);

// How many calibrations that takes, for a progress bar.
std::size_t lens_choice_steps(const CalibrationData& data);

// The data with the chosen models in its sensors.
CalibrationData with_lenses(CalibrationData data, const std::vector<LensChoice>& choices);

}  // namespace crumple
