#include "solvers/bundle.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include <Eigen/LU>
#include <fmt/format.h>

#include "solvers/parallel.h"

namespace crumple {
namespace {

using Views = std::vector<std::unique_ptr<View>>;
using GroupKey = std::pair<std::size_t, View::Kind>;

constexpr int kRobustRounds = 4;
constexpr int kMaxRounds = 20;
constexpr int kReadmittingRounds = 10;
constexpr double kCauchyScale = 2.5;
constexpr double kSigmaFloor_px = 1e-9;  // noise-free data must not divide by zero
constexpr double kSigmaSettled = 1e-6;   // relative change

GroupKey key_of(const View& view) { return {view.sensor(), view.kind()}; }

// Residuals and Jacobians of all views at a state, unwhitened.
Expected<std::vector<ViewEvaluation>> evaluate(const Views& views, const CalibrationState& state, bool with_jacobians,
                                               int threads) {
  std::vector<ViewEvaluation> evaluations(views.size());
  std::vector<char> predicted(views.size());
  parallel_for(views.size(), threads,
               [&](std::size_t v) { predicted[v] = views[v]->evaluate(state, with_jacobians, evaluations[v]); });
  for (std::size_t v = 0; v < views.size(); ++v) {
    if (predicted[v]) continue;
    return fail(fmt::format("the start cannot predict the {} of sensor {} at placement {}: its pose or lens is wrong",
                            name_of(views[v]->kind()), state.rig.sensors[views[v]->sensor()].name,
                            views[v]->placement()));
  }
  return evaluations;
}

// Sigma of each group from the median squared length of its residuals.
std::map<GroupKey, double> robust_sigmas(const Views& views, const std::vector<ViewEvaluation>& evaluations) {
  std::map<GroupKey, std::vector<double>> squares;
  std::map<GroupKey, int> dimensions;
  for (std::size_t v = 0; v < views.size(); ++v) {
    const int d = views[v]->dimension();
    dimensions[key_of(*views[v])] = d;
    for (int i = 0; i < views[v]->size(); ++i) {
      squares[key_of(*views[v])].push_back(evaluations[v].residuals.segment(d * i, d).squaredNorm());
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

void set_sigmas(const Views& views, const std::map<GroupKey, double>& sigmas, std::vector<ViewWeights>& weights) {
  for (std::size_t v = 0; v < views.size(); ++v) weights[v].sigma_px = sigmas.at(key_of(*views[v]));
}

// What one linearisation tells of each view: its whitened evaluation and the hat matrix block of each observation.
struct Linearisation {
  std::vector<ViewEvaluation> raw;                 // residuals only are read after this
  std::vector<std::vector<Eigen::Matrix2d>> hats;  // J C J' / variance, top-left d x d used
  JointCovariance covariance;
};

std::vector<Eigen::Matrix2d> hat_blocks(const View& view, const ViewEvaluation& evaluation, double variance_px2,
                                        const JointCovariance& covariance, const CalibrationState& state) {
  const Eigen::MatrixXd cov = covariance.of(view.blocks(), state);
  RowMajorMatrix jacobian(evaluation.residuals.size(), cov.cols());
  int column = 0;
  for (const RowMajorMatrix& block : evaluation.jacobians) {
    jacobian.middleCols(column, block.cols()) = block;
    column += static_cast<int>(block.cols());
  }
  const RowMajorMatrix projected = jacobian * cov;
  const int d = view.dimension();
  std::vector<Eigen::Matrix2d> hats(static_cast<std::size_t>(view.size()), Eigen::Matrix2d::Zero());
  for (int i = 0; i < view.size(); ++i) {
    hats[static_cast<std::size_t>(i)].topLeftCorner(d, d) =
        projected.middleRows(d * i, d) * jacobian.middleRows(d * i, d).transpose() / variance_px2;
  }
  return hats;
}

Expected<Linearisation> linearise(const Views& views, const std::vector<ViewWeights>& weights,
                                  const Parameters& parameters, const CalibrationState& state,
                                  const BundleOptions& options) {
  const int threads = options.threads;
  auto raw = evaluate(views, state, true, threads);
  if (!raw) return tl::unexpected(raw.error());
  NormalEquations equations(parameters);
  for (std::size_t v = 0; v < views.size(); ++v) {
    ViewEvaluation whitened = (*raw)[v];
    whiten(*views[v], weights[v], whitened);
    discount(weights[v], whitened);
    equations.add(*views[v], whitened);
  }
  for (const Prior& prior : options.priors) equations.add(prior, state);
  auto covariance = JointCovariance::create(equations, state);
  if (!covariance) return tl::unexpected(covariance.error());
  Linearisation result{std::move(*raw), std::vector<std::vector<Eigen::Matrix2d>>(views.size()),
                       std::move(*covariance)};
  parallel_for(views.size(), threads, [&](std::size_t v) {
    const double variance_px2 = weights[v].sigma_px * weights[v].sigma_px * weights[v].inflation;
    result.hats[v] = hat_blocks(*views[v], result.raw[v], variance_px2, result.covariance, state);
  });
  return result;
}

// Squared residual standardised by its own redundancy (or, for one left out, by its prediction's variance).
double standardised_square(const Eigen::VectorXd& residual_px, double sigma_px, const Eigen::Matrix2d& hat,
                           bool inlier) {
  // In one dimension the rest of the block stays the identity and the second residual zero.
  const auto d = residual_px.size();
  Eigen::Vector2d residual = Eigen::Vector2d::Zero();
  residual.head(d) = residual_px;
  const Eigen::Matrix2d variance = Eigen::Matrix2d::Identity() + (inlier ? -1 : 1) * hat;
  // An observation that alone determines something has no redundancy and cannot be tested.
  if (variance.determinant() < 1e-6) return 0;
  return residual.dot(variance.inverse() * residual) / (sigma_px * sigma_px);
}

// Re-decides every observation (without `readmit` only those that count); returns how many changed sides.
std::size_t gate_outliers(const Views& views, const Linearisation& at, double gate, bool readmit,
                          std::vector<ViewWeights>& weights) {
  std::size_t changed = 0;
  for (std::size_t v = 0; v < views.size(); ++v) {
    const int d = views[v]->dimension();
    const double limit = gate_for(d, gate);
    for (int i = 0; i < views[v]->size(); ++i) {
      char& inlier = weights[v].inlier[static_cast<std::size_t>(i)];
      if (!inlier && !readmit) continue;
      const double square = standardised_square(at.raw[v].residuals.segment(d * i, d), weights[v].sigma_px,
                                                at.hats[v][static_cast<std::size_t>(i)], inlier != 0);
      const char now = square <= limit;
      changed += now != inlier;
      inlier = now;
    }
  }
  return changed;
}

std::map<GroupKey, GroupSummary> summarise_groups(const Views& views, const Linearisation& at,
                                                  const std::vector<ViewWeights>& weights,
                                                  const BundleOptions& options) {
  std::map<GroupKey, GroupSummary> groups;
  std::map<GroupKey, double> squares, all_squares;
  for (std::size_t v = 0; v < views.size(); ++v) {
    const int d = views[v]->dimension();
    GroupSummary& group = groups[key_of(*views[v])];
    group.sensor = views[v]->sensor();
    group.kind = views[v]->kind();
    for (int i = 0; i < views[v]->size(); ++i) {
      const double square = at.raw[v].residuals.segment(d * i, d).squaredNorm();
      all_squares[key_of(*views[v])] += square;
      ++group.observations;
      if (!weights[v].inlier[static_cast<std::size_t>(i)]) {
        ++group.outliers;
        continue;
      }
      squares[key_of(*views[v])] += square;
      group.redundancy += d - at.hats[v][static_cast<std::size_t>(i)].trace();
    }
  }
  for (auto& [key, group] : groups) {
    const int d = key.second == View::Kind::stripes ? 1 : 2;
    const std::size_t accepted = group.observations - group.outliers;
    group.rms_px = accepted > 0 ? std::sqrt(squares[key] / static_cast<double>(accepted)) : 0;
    group.rms_all_px = std::sqrt(all_squares[key] / static_cast<double>(group.observations));
    group.sigma_estimated = group.redundancy >= options.minimum_redundancy;
    const double kept = options.reject_outliers ? kept_variance(d, options.gate) : 1;
    group.sigma_px = group.sigma_estimated
                         ? std::max(std::sqrt(squares[key] / (group.redundancy * kept)), kSigmaFloor_px)
                         : options.prior_sigma_px;
  }
  return groups;
}

ViewSummary summarise_view(const View& view, const ViewEvaluation& raw, const ViewWeights& weights) {
  ViewSummary summary{view.sensor(), view.placement(), view.kind(), 0, 0, weights.inlier, raw.residuals};
  const int d = view.dimension();
  double accepted_square = 0;
  int accepted = 0;
  for (int i = 0; i < view.size(); ++i) {
    if (!weights.inlier[static_cast<std::size_t>(i)]) continue;
    accepted_square += raw.residuals.segment(d * i, d).squaredNorm();
    ++accepted;
  }
  summary.rms_px = accepted > 0 ? std::sqrt(accepted_square / accepted) : 0;
  summary.rms_all_px = view.size() > 0 ? std::sqrt(raw.residuals.squaredNorm() / view.size()) : 0;
  return summary;
}

// Stage 1: leaves the state near the optimum of the good observations, and their sigmas in the weights.
Expected<void> converge_robustly(const Views& views, const BundleOptions& options, MinimiseOptions minimise_options,
                                 std::vector<ViewWeights>& weights, CalibrationState& state) {
  minimise_options.cauchy_scale = kCauchyScale;
  for (int round = 0; round < kRobustRounds; ++round) {
    const auto evaluations = evaluate(views, state, false, options.threads);
    if (!evaluations) return tl::unexpected(evaluations.error());
    set_sigmas(views, robust_sigmas(views, *evaluations), weights);
    const auto summary = minimise(views, weights, minimise_options, state);
    if (!summary) return tl::unexpected(summary.error());
  }
  const auto evaluations = evaluate(views, state, false, options.threads);
  if (!evaluations) return tl::unexpected(evaluations.error());
  set_sigmas(views, robust_sigmas(views, *evaluations), weights);
  return {};
}

double inflation_of(View::Kind kind, const BundleOptions& options) {
  switch (kind) {
    case View::Kind::corners:
      return options.corner_inflation;
    case View::Kind::stripes:
      return options.stripe_inflation;
    case View::Kind::features:
      break;
  }
  return 1;
}

std::map<GroupKey, double> sigmas_of(const std::map<GroupKey, GroupSummary>& groups) {
  std::map<GroupKey, double> sigmas;
  for (const auto& [key, group] : groups) sigmas[key] = group.sigma_px;
  return sigmas;
}

bool settled(const Views& views, const std::vector<ViewWeights>& weights, const std::map<GroupKey, double>& sigmas) {
  return std::all_of(views.begin(), views.end(), [&](const auto& view) {
    const double old_sigma = weights[static_cast<std::size_t>(&view - &views[0])].sigma_px;
    return std::abs(sigmas.at(key_of(*view)) / old_sigma - 1) < kSigmaSettled;
  });
}

}  // namespace

double gate_for(int dimension, double gate) {
  if (dimension == 2) return gate;
  // P(|z| > t) = erfc(t / sqrt 2) = exp(-gate / 2), by bisection.
  const double probability = std::exp(-gate / 2);
  double low = 0, high = std::sqrt(gate);
  for (int i = 0; i < 60; ++i) {
    const double middle = 0.5 * (low + high);
    (std::erfc(middle / std::numbers::sqrt2) > probability ? low : high) = middle;
  }
  return low * low;
}

double kept_variance(int dimension, double gate) {
  const double outside = std::exp(-gate / 2);
  if (dimension == 2) return 1 - 0.5 * gate * outside / (1 - outside);
  const double t = std::sqrt(gate_for(1, gate));
  const double density = std::exp(-t * t / 2) / std::sqrt(2 * std::numbers::pi);
  return 1 - 2 * t * density / (1 - outside);
}

std::string group_name(const Rig& rig, std::size_t sensor, View::Kind kind) {
  return fmt::format("{}.{}", rig.sensors[sensor].name, name_of(kind));
}

Expected<BundleResult> refine(const CalibrationState& start, const Observations& observations,
                              const BundleOptions& options) {
  const Views views = make_views(observations, start.board_of);
  CalibrationState state = start;
  MinimiseOptions minimise_options{.held = options.held, .threads = options.threads, .priors = options.priors};
  minimise_options.held.insert({BlockId::Kind::mount, 0});
  for (std::size_t b = 0; b < start.boards.size(); ++b) {
    if (!options.estimate_warp) minimise_options.held.insert({BlockId::Kind::warp, b});
    minimise_options.held.insert({BlockId::Kind::scale, b});
  }
  const Parameters parameters(state, views, minimise_options.held);
  std::vector<ViewWeights> weights;
  for (const auto& view : views) {
    weights.push_back(
        {1, inflation_of(view->kind(), options), std::vector<char>(static_cast<std::size_t>(view->size()), 1)});
  }

  if (const auto done = converge_robustly(views, options, minimise_options, weights, state); !done) {
    return tl::unexpected(done.error());
  }
  for (int round = 1;; ++round) {
    auto at = linearise(views, weights, parameters, state, options);
    if (!at) return tl::unexpected(at.error());
    if (round == 1 && options.reject_outliers) gate_outliers(views, *at, options.gate, true, weights);
    const auto summary = minimise(views, weights, minimise_options, state);
    if (!summary) return tl::unexpected(summary.error());
    at = linearise(views, weights, parameters, state, options);
    if (!at) return tl::unexpected(at.error());
    const auto groups = summarise_groups(views, *at, weights, options);
    const bool same_sigmas = settled(views, weights, sigmas_of(groups));
    std::vector<ViewWeights> next = weights;
    set_sigmas(views, sigmas_of(groups), next);
    const std::size_t changed =
        options.reject_outliers ? gate_outliers(views, *at, options.gate, round < kReadmittingRounds, next) : 0;
    const bool unchanged = changed == 0 && same_sigmas;
    if (unchanged || round == kMaxRounds) {
      std::vector<Undetermined> undetermined = undetermined_terms(options.priors, at->covariance, state);
      BundleResult result{std::move(state),       {}, {}, std::move(at->covariance), round, unchanged,
                          std::move(undetermined)};
      for (const auto& [key, group] : groups) result.groups.push_back(group);
      for (std::size_t v = 0; v < views.size(); ++v) {
        result.views.push_back(summarise_view(*views[v], at->raw[v], weights[v]));
      }
      return result;
    }
    weights = std::move(next);
  }
}

}  // namespace crumple
