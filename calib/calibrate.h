// From observations to a calibrated rig: closed-form start, then the joint refinement. Of a probe that stands still
// (calib/initial_rig.h), or of a whole system: a probe moved about before boards, trackers that see its LEDs
// (calib/initial_system.h).
//
// Or from an earlier rig with its covariance (calib/start_from_rig.h): its sensors and LEDs are known then, and what
// the new observations say of them is weighed against that. Boards and bars of the same name are the same ones: their
// certificates were counted when the rig was made, and are not counted again. What the rig's scale lacks stays missing.
//
// Lens terms that observations can hardly tell apart have weak priors (calib/lens_prior.h), beside the priors given.
//
// Stripe readings are refined twice: once as if they were independent, which shows how their residuals are correlated
// (calib/correlation.h), and once weighted by their effective number.
#pragma once

#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "calib/calibration_data.h"
#include "calib/correlation.h"
#include "calib/scale_uncertainty.h"
#include "solvers/bundle.h"

namespace crumple {

// Whether the boards' warp terms, two each, are estimated. `automatic` keeps them where they are significant: the Wald
// statistic w' C^-1 w of all of them exceeds what flat boards reach once in a thousand times, 13.8 for one board.
enum class WarpChoice { off, on, automatic };

// An earlier calibration to go on from: what it knew is the prior of the refinement (calib/rig_prior.h).
struct EarlierRig {
  Rig rig;
  std::map<std::string, double> board_scales = {};  // true over nominal size, as it was found then; by name
  // Sensors, and LEDs as `leds`, that new observations may correct; the others keep what the rig says. Empty: all may.
  std::set<std::string> corrected = {};
};

struct CalibrationOptions {
  WarpChoice warp = WarpChoice::automatic;
  BundleOptions bundle = {};
  std::optional<EarlierRig> earlier = {};
};

// Variances that were estimated from residuals, as estimates (calib/weighting.h): the groups' sigmas, squared, then
// variance inflations.
struct VarianceEstimates {
  std::vector<std::optional<std::size_t>> of_group = {};  // in the bundle's order; none: the sigma is known beforehand
  Eigen::MatrixXd half_relative_covariance = {};          // the diagonal is one over degrees of freedom
  // What each contributes to the covariance of the common parameters, C N_i C.
  std::vector<Eigen::MatrixXd> shares = {};
};

struct Calibration {
  std::vector<std::string> placement_names = {};
  std::vector<std::string> station_names = {};
  CalibrationState start;  // the closed forms; of a system, its parts refined each by itself
  BundleResult bundle;
  bool warp_estimated = false;
  double warp_statistic = 0;  // where it was tried
  Inflation inflation = {};   // observations that count as one
  VarianceEstimates variances = {};
  std::vector<Prior> priors = {};
  std::optional<ScaleUncertainty> scale = {};  // none: unknown
  std::optional<EarlierRig> earlier = {};      // as in the options
  // Where parts of an earlier rig were kept: the covariance with theirs, and with what it adds to the others'
  // (calib/kept_parts.h). The bundle's is what the observations add, given what was kept.
  std::optional<JointCovariance> with_kept = {};
};

// Of everything, what was kept of an earlier rig included.
const JointCovariance& whole_covariance(const Calibration& calibration);

// What a view is of: the name of its placement or, of LEDs, of its station; "room" for LEDs fixed to the world.
std::string place_name(const Calibration& calibration, const ViewSummary& view);

Expected<Calibration> calibrate(const CalibrationData& data, const CalibrationOptions& options);

// The start by closed forms alone (a projector's wants cameras refined against the boards, and gets them), and that of
// a system with each part refined by itself.
Expected<CalibrationState> closed_forms(const CalibrationData& data, const BundleOptions& options);
Expected<CalibrationState> stage_by_stage(const CalibrationData& data, const CalibrationOptions& options);

// The data without one placement, for cross-validation.
CalibrationData without_placement(const CalibrationData& data, std::size_t placement);

// The joint covariance of what is common to all placements and stations, by name, and of the mean motion of these.
RigCovariance rig_covariance(const BundleResult& bundle);
// The same with what was kept of an earlier rig.
RigCovariance rig_covariance(const Calibration& calibration);

// The estimated rig with its covariance and each group's sigma. It holds the scale's share where a certificate tells
// it, and what that share lacks.
Rig calibrated_rig(const Calibration& calibration);

}  // namespace crumple
