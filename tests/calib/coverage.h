// Whether stated uncertainties are true: how often regions of 95 % contain what is true, over many campaigns.
//
// A region is { x : scale (x - estimate)' C^-1 (x - estimate) / n <= q }, n its dimension and q the 95 % quantile of F
// with n and nu degrees of freedom; scale and nu are the budget's (calib/uncertainty_budget.h), since sigmas are
// estimated from the same data. That is exact where one sigma is estimated. Where none is F is chi-square over n. The
// square itself (normalised estimation error squared, NEES; Bar-Shalom, Li & Kirubarajan 2001, section 5.4) is given
// over its mean where C is true, n nu / (nu - 2) for one sigma. What was measured at stations after calibration is
// judged as if sigma were known: with LEDs' from a hundred readings NEES comes out 1 % high.
//
// Quantities of a campaign
//   lens of S, mount of S, LEDs, scales   each a region of the parameters' tangents
//   all parameters                        one region of all these
//   projection of S                       a region of 2 for each of 5 x 4 points, fixed in the frame of the sensor's
//                                         mount, that truly project onto a grid over the image
//   projection of S, fixed to bodies      the same of points fixed to the boards or LEDs that were seen
//                                         (solvers/projection_uncertainty.h)
//   world point, distance of ..., sphere  of what was measured at stations after calibration (fresh_stations.h)
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "tests/calib/coverage_configurations.h"

namespace crumple {

struct CoverageRow {
  std::string quantity;
  int dimension = 0;
  int regions = 0;          // per campaign
  int trials = 0;           // campaigns
  double coverage95 = 0;    // share of regions that contain the truth
  double nees_per_dof = 0;  // mean
  // Standard errors if the uncertainties were true; regions of one campaign count as one, which is cautious.
  double coverage_error = 0;
  double nees_error = 0;
};

struct CoverageResult {
  std::vector<CoverageRow> rows;
  // Errors along the eigenvectors of the equilibrated covariance of all parameters, over their predicted sigmas: the
  // variance farthest from 1, in its standard errors. Without judge_parameters: none.
  int directions = 0;
  double worst_direction_variance = 1;
  double worst_direction_z = 0;
  int failed = 0;  // campaigns that were refused
  std::string failure;
};

// `report` is called now and then. Depends on the seed, not on the number of threads.
CoverageResult measure_coverage(const CoverageConfiguration& configuration, std::uint32_t seed, int trials, int threads,
                                const std::function<void(int done)>& report = {});

}  // namespace crumple
