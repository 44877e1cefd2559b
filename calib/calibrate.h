// From observations to a calibrated rig: closed-form start, then the joint refinement.
//
// Lens terms that observations can hardly tell apart have weak priors (calib/lens_prior.h), beside the priors given.
//
// Stripe readings are refined twice: once as if they were independent, which shows how their residuals are correlated
// (calib/correlation.h), and once weighted by their effective number.
#pragma once

#include <string>
#include <vector>

#include "calib/board_spec.h"
#include "calib/correlation.h"
#include "calib/initial_rig.h"
#include "calib/scale_uncertainty.h"
#include "solvers/bundle.h"

namespace crumple {

// What was observed, by sensors in the order of `sensors` (cameras first) and placements in the order of their names.
struct CalibrationData {
  std::vector<SensorSpec> sensors;
  std::vector<BoardSpec> boards;
  std::vector<std::size_t> board_of;            // the board each placement is of
  std::optional<Temperature> temperature = {};  // of the boards
  std::vector<std::string> placement_names;
  Observations observations;
  std::vector<PixelPairs> pairs;  // for the projectors' start
};

// Whether the boards' warp terms, two each, are estimated. `automatic` keeps them where they are significant: the Wald
// statistic w' C^-1 w of all of them exceeds what flat boards reach once in a thousand times, 13.8 for one board.
enum class WarpChoice { off, on, automatic };

struct CalibrationOptions {
  WarpChoice warp = WarpChoice::automatic;
  BundleOptions bundle = {};
};

struct Calibration {
  std::vector<std::string> placement_names;
  CalibrationState start;  // the closed forms
  BundleResult bundle;
  bool warp_estimated = false;
  double warp_statistic = 0;  // where it was tried
  Inflation inflation;        // observations that count as one
  std::vector<Prior> priors = {};
  std::optional<ScaleUncertainty> scale = {};  // none: unknown
};

Expected<Calibration> calibrate(const CalibrationData& data, const CalibrationOptions& options);

// The data without one placement, for cross-validation.
CalibrationData without_placement(const CalibrationData& data, std::size_t placement);

// The joint covariance of what is common to all placements, by name.
RigCovariance rig_covariance(const BundleResult& bundle);

// The estimated rig with its covariance and each group's sigma. It holds the scale's share where a certificate tells
// it.
Rig calibrated_rig(const Calibration& calibration);

}  // namespace crumple
