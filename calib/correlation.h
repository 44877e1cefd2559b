// How many stripe readings count as one.
//
// Neighbouring readings err alike where the sheet is not flat or the stripe model not exact. If readings at a distance
// h have the correlation rho(h), the mean of n of them has the variance sigma^2 / n times
//   D = 1 + sum over the neighbours of a reading of rho(h),
// the variance inflation (design effect) of sampling theory. rho is estimated from the residuals of a refinement, in
// rings of one thinning cell's width about each reading of a view, out to the first ring where it is not positive.
// Dividing the readings' weight by D makes them count for their effective number n / D.
#pragma once

#include <vector>

#include "solvers/bundle.h"

namespace crumple {

// `views` are those the bundle was refined with. At least 1.
double stripe_inflation(const std::vector<StripeView>& views, const BundleResult& bundle);

}  // namespace crumple
