// One run of Ceres over the whole state.
//
// Views are evaluated in parallel before each step and Ceres itself runs on one thread, so the same input gives the
// same bits at any thread count.
#pragma once

#include <memory>
#include <optional>
#include <set>
#include <vector>

#include "solvers/expected.h"
#include "solvers/prior.h"
#include "solvers/weights.h"

namespace crumple {

struct MinimiseOptions {
  std::set<BlockId> held = {};
  std::optional<double> cauchy_scale = {};  // in units of sigma; none: least squares
  int threads = 1;
  int max_iterations = 100;
  std::vector<Prior> priors = {};
};

struct MinimiseSummary {
  int iterations = 0;
  bool converged = false;
  double initial_cost = 0;  // half the sum of squares of what was minimised
  double final_cost = 0;
};

// Moves the state to the minimum. Fails, leaving the state alone, where the model cannot predict the observations at
// the start. Running out of iterations is not a failure: the summary says so.
Expected<MinimiseSummary> minimise(const std::vector<std::unique_ptr<View>>& views,
                                   const std::vector<ViewWeights>& weights, const MinimiseOptions& options,
                                   CalibrationState& state);

}  // namespace crumple
