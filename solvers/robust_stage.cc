#include "solvers/robust_stage.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <utility>

#include <fmt/format.h>

#include "solvers/groups.h"
#include "solvers/minimise.h"
#include "solvers/parallel.h"

namespace crumple {
namespace {

using Views = std::vector<std::unique_ptr<View>>;

constexpr int kRounds = 4;
constexpr double kRobustTolerance = 1e-6;  // what follows starts from here and goes on
constexpr double kCauchyScale = 2.5;
constexpr double kMostFirstDamping = MinimiseOptions().damping;  // rounds go on with the last one's, never above this

// Residuals of all views at a state, unwhitened.
Expected<std::vector<Eigen::VectorXd>> residuals_at(const Views& views, const CalibrationState& state, int threads) {
  std::vector<Eigen::VectorXd> residuals(views.size());
  std::vector<char> predicted(views.size());
  parallel_for(views.size(), threads, [&](std::size_t v) {
    ViewEvaluation evaluation;
    predicted[v] = views[v]->evaluate(state, false, evaluation);
    residuals[v] = std::move(evaluation.residuals);
  });
  for (std::size_t v = 0; v < views.size(); ++v) {
    if (predicted[v]) continue;
    return fail(fmt::format("the start cannot predict the {} of sensor {} at {}: its pose or lens is wrong",
                            name_of(views[v]->kind()), state.rig.sensors[views[v]->sensor()].name,
                            place_of(*views[v])));
  }
  return residuals;
}

// Sigma of each group from the median squared length of its residuals.
std::map<GroupKey, double> robust_sigmas(const Views& views, const std::vector<Eigen::VectorXd>& residuals) {
  std::map<GroupKey, std::vector<double>> squares;
  std::map<GroupKey, int> dimensions;
  for (std::size_t v = 0; v < views.size(); ++v) {
    const int d = views[v]->dimension();
    dimensions[key_of(*views[v])] = d;
    for (int i = 0; i < views[v]->size(); ++i) {
      squares[key_of(*views[v])].push_back(residuals[v].segment(d * i, d).squaredNorm());
    }
  }
  std::map<GroupKey, double> sigmas;
  for (auto& [key, values] : squares) {
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    // The median of chi-square is 2 ln 2 in two dimensions and 0.4549 in one.
    const double median_of_unit = dimensions[key] == 2 ? 2 * std::numbers::ln2 : 0.454936423119573;
    sigmas[key] = std::max(std::sqrt(*middle / median_of_unit), kSigmaFloor_px);
  }
  return sigmas;
}

Expected<void> set_robust_sigmas(const Views& views, const CalibrationState& state, const BundleOptions& options,
                                 std::vector<ViewWeights>& weights) {
  const auto residuals = residuals_at(views, state, options.threads);
  if (!residuals) return tl::unexpected(residuals.error());
  std::map<GroupKey, double> sigmas = robust_sigmas(views, *residuals);
  for (auto& [key, sigma_px] : sigmas) {
    if (!options.estimate_known_sigmas) sigma_px = known_sigma(state.rig, key, options).value_or(sigma_px);
  }
  set_sigmas(views, sigmas, weights);
  return {};
}

MinimiseOptions robust_options(const BundleOptions& options) {
  return {.cauchy_scale = kCauchyScale,
          .threads = options.threads,
          .priors = options.priors,
          .tolerance = kRobustTolerance};
}

// Leaves the state near the optimum of the good observations, and their sigmas in the weights. Whether the last round
// came to a minimum.
Expected<bool> converge_robustly(const Views& views, const Parameters& parameters, const BundleOptions& options,
                                 std::vector<ViewWeights>& weights, CalibrationState& state) {
  MinimiseOptions minimise_options = robust_options(options);
  bool converged = false;
  for (int round = 0;; ++round) {
    if (const auto set = set_robust_sigmas(views, state, options, weights); !set) return tl::unexpected(set.error());
    if (round == kRounds) return converged;
    const auto minimum = minimise(views, weights, parameters, minimise_options, state);
    if (!minimum) return tl::unexpected(minimum.error());
    minimise_options.damping = std::min(kMostFirstDamping, minimum->damping);
    converged = minimum->converged;
  }
}

// Of a state that predicts all observations.
double robust_cost(const Views& views, const Parameters& parameters, const BundleOptions& options,
                   const std::vector<ViewWeights>& weights, CalibrationState state) {
  MinimiseOptions as_it_is = robust_options(options);
  as_it_is.max_iterations = 0;
  return minimise(views, weights, parameters, as_it_is, state)->initial_cost;
}

}  // namespace

Expected<void> robust_stage(const CalibrationState& start, const std::vector<std::unique_ptr<View>>& views,
                            const Parameters& parameters, const BundleOptions& options,
                            std::vector<ViewWeights>& weights, CalibrationState& state) {
  state = start;
  auto& sensors = state.rig.sensors;
  for (std::size_t s = 0; s < sensors.size(); ++s) {
    const bool estimated = parameters.estimated({BlockId::Kind::lens, sensors[s].lens_of.value_or(s)});
    if (estimated) sensors[s].lens = sensors[s].lens.past_folds();
  }
  const auto past_folds = converge_robustly(views, parameters, options, weights, state);
  for (Sensor& sensor : sensors) sensor.lens = sensor.lens.within_folds();
  const bool predicts = past_folds && set_robust_sigmas(views, state, options, weights);
  if (predicts && *past_folds) return {};
  CalibrationState other = start;
  std::vector<ViewWeights> other_weights = weights;
  const auto within = converge_robustly(views, parameters, options, other_weights, other);
  if (!within && !predicts) return tl::unexpected(within.error());
  const bool other_is_better =
      within && (!predicts || robust_cost(views, parameters, options, other_weights, other) <
                                  robust_cost(views, parameters, options, other_weights, state));
  if (!other_is_better) return {};
  state = std::move(other);
  weights = std::move(other_weights);
  return {};
}

}  // namespace crumple
