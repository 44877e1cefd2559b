// How many correlated observations count as one.
//
// Neighbouring stripe readings err alike where the sheet is not flat or the stripe model not exact, and so do corners.
// If observations at a distance h have the correlation rho(h), the mean of n of them has the variance sigma^2 / n times
//   D = 1 + sum over the neighbours of an observation of rho(h),
// the variance inflation (design effect) of sampling theory. rho is estimated from the residuals of a refinement, in
// rings about each observation of a view, as wide as stripe readings are thinned or corners are apart, out to the first
// ring where it does not exceed what uncorrelated observations would scatter by.
// Dividing the observations' weight by D makes them count for their effective number n / D.
#pragma once

#include "solvers/bundle.h"

namespace crumple {

struct Inflation {
  double corners = 1;
  double stripes = 1;
};

// `observations` are those the bundle was refined with. Each is at least 1.
Inflation inflation(const Observations& observations, const BundleResult& bundle);

}  // namespace crumple
