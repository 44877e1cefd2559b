// What a covariance lacks because the observations were weighted by estimates of their variances.
//
// The covariance of a refinement, C = (J'J)^-1, takes the groups' sigmas (and variance inflations) for the true ones.
// They are estimates: weights a little off make the parameters scatter more than C says, and C itself, at weights that
// seem best for these data, comes out too small, by as much again. Together, with N_k = J_k'J_k the information of the
// observations whose variance is estimated together and nu_k the degrees of freedom of that estimate,
//   4 sum_k 1/nu_k C (N_k - N_k C N_k) C
// (Kackar & Harville, JASA 79, 1984; Kenward & Roger, Biometrics 53, 1997, with V linear in its variances and their
// estimates' variances 2 sigma_k^4 / nu_k; of a weighted mean it is Meier, Biometrics 9, 1953). Of a direction that two
// groups of a hundred degrees of freedom tell equally well this is 2 % of the variance; of one that a single group
// tells, nothing.
//
// Variances estimated together: each group's sigma, or that of the small groups of a kind that have one in common, and
// the inflation of all groups of a kind (calib/uncertainty_budget.h). Sigmas known beforehand and priors count as
// exact. Not in it: that which observations are outliers hangs on the sigmas too.
#pragma once

#include "calib/calibrate.h"

namespace crumple {

// Rows and columns as those of the calibration's common parameters; its covariance not widened yet. Positive
// semidefinite.
Eigen::MatrixXd weighting_covariance(const Observations& observations, const Calibration& calibration, int threads);

}  // namespace crumple
