// Nonlinear least squares of a few parameters, with their covariance: resections, hand-eye poses and other fits that
// are not the joint refinement (solvers/minimise.h), which has a structure of its own.
//
//   minimise |r(x)|^2,   cov(x) = s^2 (J'J)^-1,   s^2 = |r|^2 / (residuals - parameters)
//
// where no sigma of the residuals is given; with one, s is that. Levenberg-Marquardt with QR steps (Ceres underneath).
// The covariance comes from a QR factor of the Jacobian with its columns scaled to unit length, never from J'J:
// problems whose condition is 1e8 keep half their digits. Where the scaled Jacobian's smallest pivot is below 1e-12 of
// the largest, the parameters are not determined, and that is an error. Proven against the certified values of NIST's
// Statistical Reference Datasets (tests/solvers/nist_strd_test.cc).
#pragma once

#include <functional>
#include <optional>

#include <Eigen/Core>

#include "solvers/expected.h"

namespace crumple {

struct SmallProblem {
  int residuals = 0;
  // The residuals at x and, where asked for, their Jacobian; false where the model has no value there.
  std::function<bool(const Eigen::VectorXd& x, Eigen::VectorXd& residuals, Eigen::MatrixXd* jacobian)> evaluate;
};

struct SmallProblemOptions {
  std::optional<double> sigma;  // of the residuals; none: from the fit itself
  int max_iterations = 2000;
};

struct SmallSolution {
  Eigen::VectorXd x;
  Eigen::MatrixXd covariance;
  double sum_of_squares = 0;
  double sigma = 0;  // s
  int iterations = 0;
};

Expected<SmallSolution> solve(const SmallProblem& problem, const Eigen::VectorXd& start,
                              const SmallProblemOptions& options);

}  // namespace crumple
