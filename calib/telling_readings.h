// What of a campaign's readings tells of a rig that may have changed: not those that fit no rig of the kind.
// `views`: a refinement's summaries of all observations, those of each kind in the order of `all`.
#pragma once

#include <vector>

#include "solvers/bundle.h"
#include "solvers/observations.h"

namespace crumple {

// Without errors of decoding.
std::vector<StripeView> accepted_stripes(const std::vector<StripeView>& all, const std::vector<ViewSummary>& views);

// Without LEDs that were misread; but where these are most of what a tracker read at a station, or of what was read of
// a tracker or an LED, it is that which changed.
std::vector<LedView> telling_leds(const std::vector<LedView>& all, const std::vector<ViewSummary>& views);

}  // namespace crumple
