// The covariance of a least-squares fit whose residuals are correlated in time: poses taken thirty times a second by
// one lens err alike from one to the next, and count for fewer than they are.
//
// Source: Newey & West, A simple, positive semi-definite, heteroskedasticity and autocorrelation consistent covariance
// matrix, Econometrica 1987: with the scores g_i = J_i' r_i of whitened residuals in their order,
//   cov = H^-1 S H^-1,  S = sum_i g_i g_i' + sum_k (1 - k / (m + 1)) sum_i (g_i g_{i+k}' + g_{i+k} g_i'),
// H^-1 the inverse information. The reach m is twice the lag at which the residuals' mean autocorrelation has fallen
// below a tenth, at most a quarter of their number.
#pragma once

#include <Eigen/Core>

namespace crumple {

// One row of residuals and of scores per instant, in time's order.
int correlation_reach(const Eigen::MatrixXd& residuals);

Eigen::MatrixXd serial_covariance(const Eigen::MatrixXd& inverse_information, const Eigen::MatrixXd& scores, int reach);

}  // namespace crumple
