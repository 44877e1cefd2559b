// The gate beyond which a standardised squared residual is an outlier (solvers/bundle.h), in one dimension and two.
#pragma once

#include <Eigen/Core>

namespace crumple {

// The gate in one dimension that clean data exceeds as often as `gate` in two; in two dimensions `gate` itself.
double gate_for(int dimension, double gate);

// The variance left, of one, in a chi-square distribution of 1 or 2 dimensions cut at its gate.
double kept_variance(int dimension, double gate);

// Squared residual standardised by its own redundancy (or, for one left out, by its prediction's variance), and the
// degrees of freedom it has.
struct StandardisedSquare {
  double value = 0;
  int freedom = 2;
};

// `whitened`: one residual or two over their sigma; `hat`: its block of the hat matrix, of which as much is used. 0
// where the observation alone determines something; unless it can be spared, also where it does so in one direction
// only.
StandardisedSquare standardised_square(const Eigen::VectorXd& whitened, const Eigen::Matrix2d& hat, bool inlier,
                                       bool dispensable);

}  // namespace crumple
