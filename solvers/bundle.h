// The joint refinement: the state that explains all observations best, which of them are outliers, how large the noise
// of each group is, and the covariance that follows.
//
//   1. Robust (solvers/robust_stage.h): Cauchy loss, sigma of each group from the median of its residuals, repeated
//      until that settles. On the way lenses that are estimated may fold inside what was observed
//      (Lens::past_folds).
//   2. Gate and solve: an observation is an outlier where its squared residual, standardised by its own redundancy,
//      r' (I - J C J')^-1 r / sigma^2, exceeds the gate: 16 in two dimensions, and in one the 12.87 that clean data
//      exceeds equally often (3.4 in 10,000); more where sigma is known from few observations (solvers/gate.h), it
//      being that without the observation. Those left out are tested with I + J C J'. Least squares on the rest, sigma
//      anew, until neither changes. From the tenth round on what is left out stays out, so that an observation on the
//      gate's edge cannot go in and out for ever. A placement or station with fewer than six accepted coordinates
//      (three corners) is tried again as a whole in the first five rounds, then left out as a whole: its pose stays
//      where it was and is not estimated.
//   3. Sigma of a group: its sum of squares over its redundancy (observations less the trace of their hat matrix), and
//      over the share of the variance that a chi-square distribution cut at the gate keeps. A group with a redundancy
//      under 50 takes that of all groups of its kind together; where that is under 50 too it keeps its prior sigma and
//      says so.
//
// Priors (solvers/prior.h) count as observations of their own, in the solve and in the covariance; they are whitened
// already and never outliers. Weak ones name what the observations leave undetermined.
//
// Groups are formed by sensor and kind of observation: "cam0.corners", "proj0.stripes", "cam0.features",
// "track0.leds", "proj0.overlaps".
// Gauge: the first sensor on the probe and the first in the world have their mounts held. Where the probe moves and no
// sensor is fixed to the world, the first placement is held; where the probe carries none, the first station is. The
// scale of a board is estimated where a prior tells it.
#pragma once

#include <cstddef>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "solvers/body_motion.h"
#include "solvers/prior.h"
#include "solvers/undetermined.h"

namespace crumple {

struct BundleOptions {
  bool estimate_warp = false;
  bool reject_outliers = true;
  double gate = 16;             // on the standardised square in two dimensions
  double prior_sigma_px = 0.3;  // for groups too small to estimate it from, but for those whose sigma is known
  std::map<std::string, double> known_sigma_px = {};  // by group_name(), as Rig::sigma_px
  bool estimate_known_sigmas = true;                  // of groups that are large enough for it
  double minimum_redundancy = 50;
  // Variance inflation of corners, of stripe readings and of overlaps: how many correlated ones count as one
  // (calib/correlation.h). It scales their weight and so the covariance; sigma and the gate are of single observations.
  double corner_inflation = 1;
  double stripe_inflation = 1;
  double overlap_inflation = 1;
  std::set<BlockId> held = {};   // further blocks that keep their start, such as a lens known from elsewhere
  std::set<BlockId> freed = {};  // not held for the gauge, where a prior fixes the frame
  // LEDs and room targets left out as a whole where fewer than two readings agree; else they could not be determined.
  // Others keep all their readings then, unless a prior tells their place: nothing tells which of them is wrong.
  std::set<std::size_t> dispensable_leds = {};
  std::vector<Prior> priors = {};
  int threads = 1;
};

struct GroupSummary {
  std::size_t sensor = 0;
  View::Kind kind = View::Kind::corners;
  double sigma_px = 0;  // per coordinate
  bool sigma_estimated = true;
  double rms_px = 0;      // of the accepted observations, length of the residual vector per observation
  double rms_all_px = 0;  // of all of them
  std::size_t observations = 0;
  std::size_t outliers = 0;
  double redundancy = 0;
  double standardised_limit = 0;  // of ViewSummary::standardised, of accepted observations
  // A gross error of this length, in the direction where it shows least, puts an observation beyond the limit with a
  // probability of 80 % (Baarda's minimal detectable bias): median of the accepted observations. None where half of
  // them or more cannot be tested.
  std::optional<double> gross_error_px = {};
};

struct ViewSummary {
  std::size_t sensor = 0;
  std::optional<std::size_t> placement = {};  // none: LEDs
  std::optional<std::size_t> station = {};    // none: of a probe that stands still, or of what is fixed to the world
  View::Kind kind = View::Kind::corners;
  double rms_px = 0;  // of the accepted observations
  double rms_all_px = 0;
  std::vector<char> inlier;
  Eigen::VectorXd residuals_px;  // dimension() per observation
  // One per observation.
  std::vector<float> redundancy;    // 0 to dimension(): that less the trace of its hat block; NaN of one left out
  std::vector<float> standardised;  // root of the square that the gate tests (Baarda's w in one dimension); 0: untested
};

struct BundleResult {
  CalibrationState state;
  std::vector<GroupSummary> groups;
  std::vector<ViewSummary> views;  // in the order of make_views
  JointCovariance covariance;
  int rounds = 0;                               // of gating and solving
  bool settled = false;                         // whether the last round changed no observation's side and no sigma
  TangentFunction body_motions = {};            // solvers/body_motion.h
  std::vector<Undetermined> undetermined = {};  // terms that weak priors decide
};

Expected<BundleResult> refine(const CalibrationState& start, const Observations& observations,
                              const BundleOptions& options);

std::string group_name(const Rig& rig, std::size_t sensor, View::Kind kind);

// How many observations of a kind count as one, by the options.
double inflation_of(View::Kind kind, const BundleOptions& options);

}  // namespace crumple
