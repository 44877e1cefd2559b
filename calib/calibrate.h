// From observations to a calibrated rig: closed-form start, then the joint refinement.
//
// Lens terms that observations can hardly tell apart have weak priors (calib/lens_prior.h), beside the priors given.
//
// Stripe readings are refined twice: once as if they were independent, which shows how their residuals are correlated
// (calib/correlation.h), and once weighted by their effective number.
#pragma once

#include <string>
#include <vector>

#include "calib/initial_rig.h"
#include "solvers/bundle.h"

namespace crumple {

// What was observed, by sensors in the order of `sensors` (cameras first) and placements in the order of their names.
struct CalibrationData {
  std::vector<SensorSpec> sensors;
  Board board;
  std::vector<std::string> placement_names;
  Observations observations;
  std::vector<PixelPairs> pairs;  // for the projectors' start
};

// Whether the board's two warp terms are estimated. `automatic` keeps them where they are significant: the Wald
// statistic w' C^-1 w of the pair exceeds 13.8, which a flat board does once in a thousand.
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
  double warp_statistic = 0;    // where it was tried
  double stripe_inflation = 1;  // stripe readings that count as one (calib/correlation.h)
  std::vector<Prior> priors = {};
};

Expected<Calibration> calibrate(const CalibrationData& data, const CalibrationOptions& options);

// The data without one placement, for cross-validation.
CalibrationData without_placement(const CalibrationData& data, std::size_t placement);

// Rows and columns of the joint covariance that belong to the rig, by name.
RigCovariance rig_covariance(const BundleResult& bundle);

// The estimated rig with its covariance and each group's sigma.
Rig calibrated_rig(const Calibration& calibration);

}  // namespace crumple
