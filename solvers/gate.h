// The gate beyond which a standardised squared residual is an outlier (solvers/bundle.h), in one dimension and two.
#pragma once

#include <limits>

#include <Eigen/Core>

namespace crumple {

// The gate in 1 or 2 dimensions that clean data exceeds as often as `gate` in two where the variance is known,
// exp(-gate / 2): in two dimensions `gate` itself. Of a variance estimated from other data with `freedom` degrees of
// freedom it is the F distribution's, above that.
double gate_for(int dimension, double gate, double freedom = std::numeric_limits<double>::infinity());

// A standardised square of an observation that took part in the estimate of its variance, of `freedom` degrees, as if
// it had not, so that it is tested as it would be were it left out (internally to externally studentised; Cook &
// Weisberg, Residuals and Influence in Regression, 1982, section 2.2.1). `own_square` and `own_freedom` are its part of
// the sum of squares, over the variance, and of the freedom. Without it the others' squares become smaller too, which
// is left out: one on the gate's edge stays where it is. Infinite where the variance was told by it alone.
double without_itself(double square, double own_square, double own_freedom, double freedom);

// The variance left, of one, in a chi-square distribution of 1 or 2 dimensions cut at its gate.
double kept_variance(int dimension, double gate);

// What the gate costs where all data are clean, as a share of the information of observations without leverage: those
// left out by chance are those that disagree most with what the others tell, so that without them it scatters more than
// their number says, by P(out) (E(square | out) / dimension - 1). To first order in P(out) it is the loss of the
// estimator that leaves out beyond a limit (Huber, Robust Statistics, 1981, section 1.2).
double cost_of_gate(int dimension, double gate);

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
