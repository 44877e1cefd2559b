// Do two estimates of the same things differ by more than their uncertainties
// say, when each is known only up to a rigid motion of its frame?
//
// d holds the differences of many points, two numbers (px) or three (mm) each;
// their covariance is F F'. A small motion m of the frame changes d by A m, so
// m is fitted first, each point weighted by the inverse of its own covariance
// W^-1:
//   m = G d,  G = (A' W A)^-1 A' W;      what remains is P d with the
//   covariance (P F)(P F)',  P = I - A G.
// With P F = U S V' (singular values) the components U' P d are independent,
// and
//   T = sum_k (u_k' P d)^2 / (s_k^2 + e^2)
// is chi-square distributed where nothing but the estimates' noise differs. e
// is what a difference of `floor` at every point amounts to: smaller ones count
// as none, lest rounding and terms of second order be found significant. The
// degrees of freedom are the sum of s_k^2 / (s_k^2 + e^2). What remains of P d
// outside of U no uncertainty can explain: lens models that differ, or
// parameters that were held; it is told apart.
#pragma once

#include <vector>

#include <Eigen/Core>

namespace crumple {

struct Differences {
  int dimension = 2;         // numbers per point
  Eigen::VectorXd values;    // d
  Eigen::MatrixXd by_frame;  // A; no columns where the frame is given
  Eigen::MatrixXd root;      // F; no columns where nothing is uncertain
  double floor = 0;          // per point, above zero, in the unit of d
};

struct AlignedDifference {
  Eigen::VectorXd motion;                   // m
  Eigen::MatrixXd root_of_motion;           // G F
  Eigen::VectorXd values;                   // P d
  Eigen::MatrixXd root;                     // P F
  std::vector<Eigen::MatrixXd> covariance;  // of each point
  double statistic = 0;                     // T
  int degrees = 0;                          // rounded; 0 where nothing is uncertain
  double probability = 1;                   // of a T at least as large from noise alone
  double unexplained = 0;                   // RMS over the points, outside of U

  int points() const { return static_cast<int>(covariance.size()); }
  double rms() const;              // of the points' lengths
  double expected_rms() const;     // that noise alone would make
  double length(int point) const;  // |d|
  double sigmas(int point) const;  // its length in units of its own covariance, the floor included
  double sigma(int point) const;   // standard uncertainty in the worst direction
  double floor = 0;
  int dimension = 2;
};

// As many points as make more numbers than the frame has parameters.
AlignedDifference aligned_difference(const Differences& differences);

// F of C = F F', with columns of its own for every row; rows of zero are held
// parameters.
Eigen::MatrixXd covariance_root(const Eigen::MatrixXd& covariance);

// The probability of a normal distribution outside of k standard deviations,
// 0.0455 for 2.
double outside_probability(double k);

}  // namespace crumple
