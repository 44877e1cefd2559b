// The joint refinement by Ceres: blocks of parameters, analytic Jacobians view by view, placements eliminated
// (DENSE_SCHUR). The oracle of solvers/minimise.h, which replaced it (docs/calibration.md says why), and its peer in
// `./dev bench bundle`.
#pragma once

#include <memory>
#include <vector>

#include "solvers/minimise.h"

namespace crumple {

struct CeresMinimum {
  int iterations = 0;
  bool converged = false;
  double final_cost = 0;  // half the sum of squares
};

// As minimise(): moves the state to the minimum. Views are evaluated on options.threads threads, Ceres runs on one.
Expected<CeresMinimum> minimise_by_ceres(const std::vector<std::unique_ptr<View>>& views,
                                         const std::vector<ViewWeights>& weights, const Parameters& parameters,
                                         const MinimiseOptions& options, CalibrationState& state);

}  // namespace crumple
