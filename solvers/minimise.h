// One run of Levenberg-Marquardt over the whole state.
//
// Each step solves the normal equations of solvers/normal_equations.h, damped by a multiple of their diagonal
// (Marquardt 1963). A step that lowers the cost is taken, and the damping follows how well the linearised model
// foretold the decrease; one that does not, or that leads to where the model predicts nothing, is given up and the
// damping raised. It ends where the linearised model sees no more to gain than a 1e-14th of the cost. General solvers
// spend most of their time on what this problem does not need: they keep the whole Jacobian and find its structure
// anew. A general one (Ceres) is the oracle in the tests.
//
// The same input gives the same bits at any thread count.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "solvers/expected.h"
#include "solvers/normal_equations.h"
#include "solvers/weights.h"

namespace crumple {

struct MinimiseOptions {
  std::optional<double> cauchy_scale = {};  // in units of sigma; none: least squares
  int threads = 1;
  int max_iterations = 100;
  std::vector<Prior> priors = {};
  double tolerance = 1e-14;  // of the predicted decrease, relative to the cost
  double damping = 1e-4;     // of the first step; one that goes on from another's minimum takes that one's last
};

struct Minimum {
  int iterations = 0;
  bool converged = false;
  double initial_cost = 0;  // half the sum of squares of what was minimised
  double final_cost = 0;
  double damping = 0;         // after the last step
  NormalEquations equations;  // there; they refer to the parameters
};

// Moves the state to the minimum. Fails, leaving the state alone, where the model cannot predict the observations at
// the start. Running out of iterations is not a failure: the result says so.
Expected<Minimum> minimise(const std::vector<std::unique_ptr<View>>& views, const std::vector<ViewWeights>& weights,
                           const Parameters& parameters, const MinimiseOptions& options, CalibrationState& state);

}  // namespace crumple
