#include "solvers/minimise.h"

#include <algorithm>
#include <utility>

namespace crumple {
namespace {

constexpr double kLeastDamping = 1e-14;
constexpr double kMostDamping = 1e12;
constexpr double kFirstRaise = 10;
constexpr double kHardlyDamped = 1;  // a step that is damped more may foretell no gain anywhere

// How strongly steps are damped, by how well the linearised model foretold the last one.
class Damping {
 public:
  explicit Damping(double value) : value_(value) {}

  double value() const { return value_; }
  bool exhausted() const { return value_ > kMostDamping; }

  // After a step that was taken. `gain`: the decrease of the cost over the predicted one; where it is small, shorter
  // steps come nearer to the floor of a curved valley.
  void adapt(double gain) {
    const double factor = gain > 0.75 ? 0.03 : gain > 0.25 ? 0.5 : 8;
    value_ = std::max(value_ * factor, kLeastDamping);
    raise_ = kFirstRaise;
  }
  // After one that was given up.
  void raise() {
    value_ *= raise_;
    raise_ *= 2;
  }

 private:
  double value_;
  double raise_ = kFirstRaise;
};

}  // namespace

Expected<Minimum> minimise(const std::vector<std::unique_ptr<View>>& views, const std::vector<ViewWeights>& weights,
                           const Parameters& parameters, const MinimiseOptions& options, CalibrationState& state) {
  const auto equations_at = [&](const CalibrationState& at) {
    const auto evaluate = [&](std::size_t v, ViewEvaluation& evaluation) {
      if (!views[v]->evaluate(at, true, evaluation) || !evaluation.residuals.allFinite()) return false;
      whiten(*views[v], weights[v], evaluation);
      if (options.cauchy_scale) robustify(*views[v], *options.cauchy_scale, evaluation);
      discount(weights[v], evaluation);
      return true;
    };
    auto equations = NormalEquations::of(views, parameters, evaluate, options.threads);
    for (const Prior& prior : options.priors) {
      if (equations) equations->add(prior, at);
    }
    return equations;
  };

  auto equations = equations_at(state);
  if (!equations) return fail("the joint refinement failed: the start is too far from the observations");
  const double initial_cost = equations->cost();
  Damping damping(options.damping);
  int iterations = 0;
  bool converged = false;
  while (iterations < options.max_iterations && !damping.exhausted()) {
    const auto step = equations->solve(damping.value(), options.threads);
    if (!step) {
      damping.raise();
      continue;
    }
    if (step->predicted_decrease <= options.tolerance * equations->cost()) {
      converged = damping.value() <= kHardlyDamped;
      break;
    }
    ++iterations;
    CalibrationState tried = moved(state, parameters, step->tangent);
    auto there = equations_at(tried);
    const double gain = there ? (equations->cost() - there->cost()) / step->predicted_decrease : -1;
    if (gain > 0) {
      state = std::move(tried);
      equations = std::move(there);
      damping.adapt(gain);
    } else {
      damping.raise();
    }
  }
  const double final_cost = equations->cost();
  return Minimum{iterations, converged, initial_cost, final_cost, damping.value(), std::move(*equations)};
}

}  // namespace crumple
