// How many correlated observations count as one.
//
// Neighbouring stripe readings err alike where the sheet is not flat or the stripe model not exact, and so do corners.
// If observations at a distance h have the correlation rho(h), the mean of n of them has the variance sigma^2 / n times
//   D = 1 + sum over the neighbours of an observation of rho(h),
// the variance inflation (design effect) of sampling theory. Dividing the observations' weight by D makes them count
// for their effective number n / D. Two estimates are made from the residuals of a refinement; the larger one counts.
//   near   rho in rings about each observation of a view, as wide as stripe readings are thinned or corners are apart,
//          out to the first ring where it does not exceed what uncorrelated observations would scatter by
//   far    what is left of each view's residuals in the polynomials of up to fourth degree over the image, where the
//          parameters take their information from: sum of squares over its expectation for uncorrelated ones,
//            sum_k (q_k' r)^2 / sigma^2   over   sum_k (1 - q_k' J C J' q_k / sigma^2),   q_k orthonormal over the view
//          It sees correlations that are too weak for the rings and reach over much of a view. A view has polynomials
//          for a quarter of its observations at most, so those of a small board end at a lower degree. It is taken as
//          it comes, but never below 1: uncorrelated observations count for less, by 4 % where it has 200 degrees of
//          freedom, by 7 % where it has 60.
// Degrees of freedom: the expectation above, whichever estimate counts. That is what errors have that are as large
// along all polynomials and not the same in several views; what all views have in common is known less well than it
// says.
#pragma once

#include <limits>

#include "solvers/bundle.h"

namespace crumple {

struct Inflation {
  double corners = 1;
  double stripes = 1;
  // How well they are known; infinite where there is too little to see.
  double corner_degrees_of_freedom = std::numeric_limits<double>::infinity();
  double stripe_degrees_of_freedom = std::numeric_limits<double>::infinity();
  double of(View::Kind kind) const {
    if (kind == View::Kind::corners) return corners;
    return kind == View::Kind::stripes ? stripes : 1;
  }
  double degrees_of_freedom(View::Kind kind) const {
    if (kind == View::Kind::corners) return corner_degrees_of_freedom;
    return kind == View::Kind::stripes ? stripe_degrees_of_freedom : std::numeric_limits<double>::infinity();
  }
};

// `observations` are those the bundle was refined with, independent ones assumed. Each is at least 1.
Inflation inflation(const Observations& observations, const BundleResult& bundle, int threads);

}  // namespace crumple
