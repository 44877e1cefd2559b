// The first stage of a refinement (solvers/bundle.h): from a start to near the optimum of the good observations, by the
// Cauchy loss, with each group's sigma from the median of its residuals.
//
// Lenses that are estimated may fold inside what was observed on the way (Lens::past_folds). Where they end so, or at
// no minimum, the way within their folds is tried too, and the better end taken.
#pragma once

#include <memory>
#include <vector>

#include "solvers/bundle.h"
#include "solvers/parameters.h"
#include "solvers/residuals.h"
#include "solvers/weights.h"

namespace crumple {

// Leaves the state there, and the sigmas in the weights. Fails where the start cannot predict what was observed.
Expected<void> robust_stage(const CalibrationState& start, const std::vector<std::unique_ptr<View>>& views,
                            const Parameters& parameters, const BundleOptions& options,
                            std::vector<ViewWeights>& weights, CalibrationState& state);

}  // namespace crumple
