// Least squares without a loss or a gate, by the joint refinement's own minimiser, and the covariance that follows: for
// comparisons with adjustments that others published, whose weights are given.
#pragma once

#include <memory>
#include <vector>

#include "solvers/covariance.h"
#include "solvers/minimise.h"

namespace crumple {

struct JointProblem {
  const std::vector<std::unique_ptr<View>>& views;
  const std::vector<ViewWeights>& weights;
  std::vector<Prior> priors = {};
  int threads = 1;
};

// Whitened by the given weights, at a state; refers to both.
inline NormalEquations::Evaluate whitened_views(const JointProblem& problem, const CalibrationState& state) {
  return [&](std::size_t v, ViewEvaluation& evaluation) {
    if (!problem.views[v]->evaluate(state, true, evaluation)) return false;
    whiten(*problem.views[v], problem.weights[v], evaluation);
    return true;
  };
}

inline Expected<NormalEquations> joint_equations(const JointProblem& problem, const Parameters& parameters,
                                                 const CalibrationState& state) {
  auto equations = NormalEquations::of(problem.views, parameters, whitened_views(problem, state), problem.threads);
  if (!equations) return fail("a view cannot be predicted");
  for (const Prior& prior : problem.priors) equations->add(prior, state);
  return std::move(*equations);
}

inline Expected<JointCovariance> joint_covariance(const JointProblem& problem, const Parameters& parameters,
                                                  const CalibrationState& state) {
  const auto equations = joint_equations(problem, parameters, state);
  if (!equations) return tl::unexpected(equations.error());
  auto covariance = JointCovariance::create(*equations, state);
  if (covariance) {
    covariance->sharpen(problem.views, whitened_views(problem, state), problem.priors, state, problem.threads);
  }
  return covariance;
}

struct JointMinimum {
  CalibrationState state;
  double sum_of_squares = 0;  // whitened, priors among them
};

inline Expected<JointMinimum> joint_minimum(const JointProblem& problem, const Parameters& parameters,
                                            const CalibrationState& start) {
  JointMinimum result{start};
  MinimiseOptions options;
  options.priors = problem.priors;
  options.threads = problem.threads;
  options.max_iterations = 200;
  const auto minimum = minimise(problem.views, problem.weights, parameters, options, result.state);
  if (!minimum) return tl::unexpected(minimum.error());
  result.sum_of_squares = 2 * minimum->final_cost;
  return result;
}

}  // namespace crumple
