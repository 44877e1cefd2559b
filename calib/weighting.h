// How well the groups' sigmas are known, and what a covariance lacks because the observations were weighted by them and
// chosen by their residuals.
//
// A group's variance is its sum of squares over its redundancy, repeated until weights and variances agree; that is the
// restricted maximum likelihood estimate (Forstner, A scheme for estimating variance components, 1979; Patterson &
// Thompson, Biometrika 58, 1971). With whitened Jacobians J_i, N_i = J_i'J_i, C = (sum N_i + priors)^-1 and
// R = I - J C J', the estimates s_i have the relative covariances cov(s_i, s_j) / (s_i s_j) = 2 (F^-1)_ij with
//   F_ij = tr(R_ij R_ji) = tr(C N_i C N_j) for i != j,   F_ii = n_i - 2 tr(C N_i) + tr(C N_i C N_i),
// n_i being the accepted coordinates. F to a unit diagonal has no eigenvalue below 0.05: variances that residuals do
// not tell apart at all are taken to be told by that much.
//
// Where groups hardly share parameters F is the redundancies' diagonal. Two trackers that read the same LEDs are told
// apart by few of these: residuals across epipolar lines belong to both, and the ratio of their variances is known
// less well than redundancies say, their mean better.
//
// C takes the variances for the true ones. Weights a little off make the parameters scatter more than C says, and C, at
// weights that seem best for these data, comes out too small, by as much again; together
//   4 sum_ij (F^-1)_ij C (delta_ij N_i - N_i C N_j) C
// (Kackar & Harville, JASA 79, 1984; Kenward & Roger, Biometrics 53, 1997; of a weighted mean it is Meier, Biometrics
// 9, 1953). What a single group tells does not hang on its weight.
//
// Correlated observations count for their effective number: rows and columns of F are divided by the root of their
// variance inflation. The inflations are estimates too, common to all groups of a kind (calib/correlation.h), and
// counted beside the sigmas with their own degrees of freedom. Sigmas known beforehand and priors count as exact.
//
// Where outliers were looked for (`gate`), good observations are left out too, and just those that disagree most with
// what all others tell: the covariance without such an observation knows nothing of that. Left out with probability P
// for a standardised square s, in d dimensions, observation i adds on average
//   P (E(s | out) / d - 1) C J_i'(I - H_i)^-1 J_i C,   H_i = J_i C J_i',
// to what C expects. Taken by groups, with the mean redundancy for I - H_i.
#pragma once

#include "calib/calibrate.h"

namespace crumple {

// States how well the sigmas are known (Calibration::variances) and widens the covariance by what the weights and the
// gate add. The calibration is refined and has its inflation and priors; `observations` and `options` are those it was
// made with.
void add_weighting(const Observations& observations, const BundleOptions& options, Calibration& calibration);

}  // namespace crumple
