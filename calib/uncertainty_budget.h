// The uncertainty budget of a calibration after the GUM (JCGM 100:2008): of every parameter of the rig its value,
// standard uncertainty u, expanded uncertainty U = k u with k = kCoverageFactor, degrees of freedom, and what u is made
// of.
//
// The estimate follows its sources linearly, x = sum_s G_s y_s, G_s = C J_s' with J_s the whitened Jacobian of source s
// and C the joint covariance. So its variance is the sum of the sources' shares, the diagonal of C J_s' J_s C. Sources:
//   a group of observations, such as "cam0.corners": type A; type B where the group's sigma was not estimated from its
//     residuals. Two estimates make its variance: sigma, which is correlated with other groups' (calib/weighting.h),
//     and the inflation, which all groups of a kind have in common (calib/correlation.h)
//   a prior, such as "certificates" or an earlier rig: type B, taken as exactly known, infinite degrees of freedom
//   "weights and outlier rule": what estimated sigmas add by having weighted the observations, and the rule by having
//     chosen them (calib/weighting.h); type A, and small, so that its degrees of freedom are not asked for
//   "kept parts": where parts of an earlier rig were kept, what they are off by and what that does to the others
//     (calib/kept_parts.h); type B, taken as exactly known
// Effective degrees of freedom by Welch and Satterthwaite (GUM, G.4), nu = u^4 / sum u_s^4 / nu_s, for estimates that
// are correlated: one over the variance of u^2, twice its square being 1, summed over pairs of sigmas and, with the
// shares of a kind's groups together, over inflations.
//
// Several parameters together have a region, { x : scale (x - estimate)' C^-1 (x - estimate) / l <= F }, with F the
// quantile of l and so many degrees of freedom: scale and these are chosen so that the left side's mean and variance
// are F's when the variances are estimates (Kenward & Roger, Biometrics 53, 1997, section 3). Where one sigma is
// estimated scale is 1 and the degrees of freedom are that sigma's; where none is, F is chi-square over l.
//
// Units: px, mm, and degrees for the rotation of a mount, whose value is the rotation vector and whose u that of a
// small further rotation about the sensor's axes (docs/conventions.md, tangents). Parameters that were held have no
// entry, but for kept ones that the earlier rig has a covariance of.
#pragma once

#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "calib/calibrate.h"

namespace crumple {

struct BudgetSource {
  std::string name;
  bool type_b = false;
  double sigma_degrees_of_freedom = std::numeric_limits<double>::infinity();
  std::optional<View::Kind> kind = {};  // none: no group of observations
  // Of sigma^2 with that of every source, relative to both and halved; the diagonal is 1 / sigma_degrees_of_freedom.
  std::vector<double> sigma_covariance = {};  // empty: none
  double inflation_degrees_of_freedom = std::numeric_limits<double>::infinity();
  // Of this source alone.
  double degrees_of_freedom() const { return 1 / (1 / sigma_degrees_of_freedom + 1 / inflation_degrees_of_freedom); }
};

struct BudgetEntry {
  std::string part;  // "lens of cam0", "mount of cam0", "LED a", "board"
  std::string name;  // its row of the covariance, "cam0.fx"
  std::string unit;  // empty: none
  double value = 0;
  double u = 0;
  double degrees_of_freedom = 0;    // effective; may be infinite
  double type_b_share = 0;          // of the variance
  std::vector<double> shares = {};  // of the variance, one per source; they sum to 1
};

struct BudgetRegion {
  std::string part;  // of whose parameters; "LEDs" and "all" of all of these
  int dimension = 0;
  double scale = 1;
  double degrees_of_freedom = 0;  // may be infinite
  double mean = 1;                // of the square of an error by the covariance, over the dimension
};

struct UncertaintyBudget {
  std::vector<BudgetSource> sources;
  std::vector<BudgetEntry> entries;
  std::vector<BudgetRegion> regions = {};
};

inline constexpr double kCoverageFactor = 2;

// Of a variance of which the sources have these shares.
double effective_degrees_of_freedom(const std::vector<BudgetSource>& sources, const std::vector<double>& shares);

// In the order of the bundle's groups, then of the priors, and where the covariance was widened its weights.
std::vector<BudgetSource> budget_sources(const Calibration& calibration);

// `observations` are those that the calibration was made from.
UncertaintyBudget uncertainty_budget(const Observations& observations, const Calibration& calibration, int threads);

}  // namespace crumple
