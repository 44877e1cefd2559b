// Upper tails of the distributions that sums of squares of a fit follow.
#pragma once

namespace crumple {

// P(chi-square of that many degrees of freedom > x). 1 with no degrees of freedom or x <= 0.
double chi_square_tail(double x, int degrees);

// The x that is exceeded with that probability, in (0, 1): the inverse of chi_square_tail. At least one degree.
double chi_square_exceeded(double probability, int degrees);

// The non-centrality with which a chi-square of `degrees` exceeds x with probability `power`: what a test at level
// P(chi-square > x) needs to see a change that often (Baarda 1968, lambda_0). x above 0, power above that level.
double noncentrality_seen(double x, int degrees, double power);

// P(F > f) of `degrees` over `of_variance` degrees of freedom (infinite: chi-square over its degrees): what the square
// of an error by its covariance, over its dimension, follows where that covariance is known up to one factor that was
// estimated with `of_variance` degrees of freedom (Scheffe, The Analysis of Variance, 1959, section 2.3). 1 with no
// degrees of freedom or f <= 0.
double f_tail(double f, int degrees, double of_variance);

}  // namespace crumple
