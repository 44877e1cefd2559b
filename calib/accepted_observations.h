// The observations that a mask accepts, as observations of their own.
#pragma once

#include <vector>

#include "solvers/observations.h"

namespace crumple {

// `accepted`: a flag for each observation, by view in the order of make_views (solvers/residuals.h), such as
// ViewSummary::inlier. Views of which nothing is left are dropped; placements and stations keep their numbers.
// Overlaps of surfaces are no business of a calibration: there must be none.
Observations accepted_observations(const Observations& all, const std::vector<std::vector<char>>& accepted);

}  // namespace crumple
