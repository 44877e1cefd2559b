#include "solvers/bundle.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <utility>

#include <fmt/format.h>

#include "solvers/decompositions.h"
#include "solvers/dispensable_leds.h"
#include "solvers/distribution_tails.h"
#include "solvers/gate.h"
#include "solvers/groups.h"
#include "solvers/minimise.h"
#include "solvers/parallel.h"
#include "solvers/robust_stage.h"
#include "solvers/square_root.h"
#include "solvers/untold_poses.h"

namespace crumple {
namespace {

using Views = std::vector<std::unique_ptr<View>>;

constexpr int kMaxRounds = 40;
constexpr int kReadmittingRounds = 10;
constexpr int kRetrialRounds = 5;                            // of placements without accepted observations
constexpr double kFirstDamping = MinimiseOptions().damping;  // rounds go on with the last one's, but never above this
constexpr double kSigmaSettled = 1e-6;                       // relative change
// While sigmas and outliers are still being settled: well below what moves them.
constexpr double kRoundTolerance = 1e-9;

// What one linearisation tells of each view: its residuals and the hat matrix block of each observation.
struct Linearisation {
  std::vector<Eigen::VectorXd> residuals_px;
  std::vector<std::vector<Eigen::Matrix2d>> hats;  // J C J' / variance, top-left d x d used
  JointCovariance covariance;
};

std::vector<Eigen::Matrix2d> hat_blocks(const View& view, const ViewEvaluation& evaluation, double variance_px2,
                                        const JointCovariance& covariance, const CalibrationState& state) {
  const Eigen::MatrixXd& local = evaluation.local_from_blocks;
  const Eigen::MatrixXd cov = local * covariance.of(view.blocks(), state) * local.transpose() / variance_px2;
  const RowMajorMatrix projected = evaluation.jacobian * cov;
  const int d = view.dimension();
  std::vector<Eigen::Matrix2d> hats(static_cast<std::size_t>(view.size()), Eigen::Matrix2d::Zero());
  for (int i = 0; i < view.size(); ++i) {
    hats[static_cast<std::size_t>(i)].topLeftCorner(d, d).noalias() =
        projected.middleRows(d * i, d).lazyProduct(evaluation.jacobian.middleRows(d * i, d).transpose());
  }
  return hats;
}

// Whitened, without robust loss, at a state that predicts all views. Refers to its arguments.
NormalEquations::Evaluate whitened_at(const Views& views, const std::vector<ViewWeights>& weights,
                                      const CalibrationState& state) {
  return [&](std::size_t v, ViewEvaluation& evaluation) {
    views[v]->evaluate(state, true, evaluation);
    whiten(*views[v], weights[v], evaluation);
    discount(weights[v], evaluation);
    return true;
  };
}

NormalEquations equations_at(const Views& views, const std::vector<ViewWeights>& weights, const Parameters& parameters,
                             const CalibrationState& state, const BundleOptions& options) {
  const auto evaluate = whitened_at(views, weights, state);
  NormalEquations equations = *NormalEquations::of(views, parameters, evaluate, options.threads);
  for (const Prior& prior : options.priors) equations.add(prior, state);
  return equations;
}

Expected<Linearisation> linearise(const Views& views, const std::vector<ViewWeights>& weights,
                                  const NormalEquations& equations, const CalibrationState& state,
                                  const BundleOptions& options) {
  const int threads = options.threads;
  // Directions that a weak prior holds have a condition that no squared one is good enough for.
  const bool held_weakly =
      std::any_of(options.priors.begin(), options.priors.end(), [](const Prior& prior) { return prior.weak(); });
  std::function<Eigen::MatrixXd()> square_root;
  if (held_weakly) {
    square_root = [&] {
      return reduced_square_root(views, equations.parameters(), whitened_at(views, weights, state), options.priors,
                                 state, threads);
    };
  }
  auto covariance = JointCovariance::create(equations, state, square_root);
  if (!covariance) return tl::unexpected(covariance.error());
  Linearisation result{std::vector<Eigen::VectorXd>(views.size()),
                       std::vector<std::vector<Eigen::Matrix2d>>(views.size()), std::move(*covariance)};
  parallel_for(views.size(), threads, [&](std::size_t v) {
    const double variance_px2 = weights[v].sigma_px * weights[v].sigma_px * weights[v].inflation;
    ViewEvaluation evaluation;
    views[v]->evaluate(state, true, evaluation);
    result.hats[v] = hat_blocks(*views[v], evaluation, variance_px2, result.covariance, state);
    result.residuals_px[v] = std::move(evaluation.residuals);
  });
  return result;
}

// The gates of a group whose variance is known, or was estimated with so many degrees of freedom.
struct Gates {
  Gates(int dimension, double gate, double variance_freedom)
      : freedom(variance_freedom),
        counted{gate_for(1, gate, std::max(1.0, freedom - dimension)),
                gate_for(2, gate, std::max(1.0, freedom - dimension))},
        left_out{gate_for(1, gate, freedom), gate_for(2, gate, freedom)} {}

  double freedom;
  std::array<double, 2> counted, left_out;  // of squares with one degree of freedom and two
};

// `freedoms`: of the groups' variances that were estimated.
std::map<GroupKey, Gates> gates_of(const Views& views, const std::map<GroupKey, double>& freedoms, double gate) {
  std::map<GroupKey, Gates> gates;
  for (const auto& view : views) {
    const GroupKey key = key_of(*view);
    if (gates.contains(key)) continue;
    const auto estimated = freedoms.find(key);
    const double freedom = estimated == freedoms.end() ? std::numeric_limits<double>::infinity() : estimated->second;
    gates.emplace(key, Gates(view->dimension(), gate, freedom));
  }
  return gates;
}

// An observation's standardised square, by a variance that it has no part in, and what it may not exceed.
struct GateTest {
  double square = 0;
  double limit = 0;
};

GateTest gate_test(const Eigen::VectorXd& whitened, const Eigen::Matrix2d& hat, bool inlier, bool dispensable,
                   const Gates& gates) {
  const StandardisedSquare square = standardised_square(whitened, hat, inlier, dispensable);
  const auto which = static_cast<std::size_t>(square.freedom - 1);
  if (!inlier) return {square.value, gates.left_out[which]};
  const double own_freedom = static_cast<double>(whitened.size()) - hat.trace();
  return {without_itself(square.value, whitened.squaredNorm(), own_freedom, gates.freedom), gates.counted[which]};
}

// Re-decides every observation (without `readmit` only those that count).
void gate_outliers(const Views& views, const Linearisation& at, const std::map<GroupKey, Gates>& gates,
                   const DispensableLeds& dispensable, bool readmit, std::vector<ViewWeights>& weights) {
  for (std::size_t v = 0; v < views.size(); ++v) {
    const int d = views[v]->dimension();
    const Gates& of_group = gates.at(key_of(*views[v]));
    for (int i = 0; i < views[v]->size(); ++i) {
      char& inlier = weights[v].inlier[static_cast<std::size_t>(i)];
      if (!inlier && !readmit) continue;
      const Eigen::VectorXd whitened = at.residuals_px[v].segment(d * i, d) / weights[v].sigma_px;
      const Eigen::Matrix2d& hat = at.hats[v][static_cast<std::size_t>(i)];
      const GateTest test = gate_test(whitened, hat, inlier != 0, dispensable.reads(v, i), of_group);
      inlier = test.square <= test.limit;
    }
  }
}

bool same_sides(const std::vector<ViewWeights>& a, const std::vector<ViewWeights>& b) {
  return std::equal(a.begin(), a.end(), b.begin(),
                    [](const ViewWeights& x, const ViewWeights& y) { return x.inlier == y.inlier; });
}

// Of what several groups leave over.
struct Pool {
  double square = 0;
  double redundancy = 0;
};

// And the degrees of freedom of the variances that were estimated.
struct Groups {
  std::map<GroupKey, GroupSummary> summaries;
  std::map<GroupKey, double> freedoms;
};

// `small` remembers the groups whose redundancy was once too little, lest one on the limit go to and fro.
Groups summarise_groups(const Views& views, const Linearisation& at, const std::vector<ViewWeights>& weights,
                        const CalibrationState& state, const BundleOptions& options, std::set<GroupKey>& small) {
  Groups result;
  std::map<GroupKey, GroupSummary>& groups = result.summaries;
  std::map<GroupKey, double> squares, all_squares;
  for (std::size_t v = 0; v < views.size(); ++v) {
    const int d = views[v]->dimension();
    GroupSummary& group = groups[key_of(*views[v])];
    group.sensor = views[v]->sensor();
    group.kind = views[v]->kind();
    for (int i = 0; i < views[v]->size(); ++i) {
      const double square = at.residuals_px[v].segment(d * i, d).squaredNorm();
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
  // Of one kind, and of cameras of one mount: targets that the probe sees are no LEDs before a tracker.
  const auto pool_of = [&](const GroupKey& key) { return std::pair(key.second, state.rig.sensors[key.first].mount); };
  std::map<std::pair<View::Kind, Mount>, Pool> pools;
  for (const auto& [key, group] : groups) {
    pools[pool_of(key)].square += squares[key];
    pools[pool_of(key)].redundancy += group.redundancy;
    if (group.redundancy < options.minimum_redundancy) small.insert(key);
  }
  for (auto& [key, group] : groups) {
    const int d = View::dimension_of(key.second);
    const std::size_t accepted = group.observations - group.outliers;
    group.rms_px = accepted > 0 ? std::sqrt(squares[key] / static_cast<double>(accepted)) : 0;
    group.rms_all_px = std::sqrt(all_squares[key] / static_cast<double>(group.observations));
    const Pool& pool = pools[pool_of(key)];
    const Pool own = small.contains(key) ? pool : Pool{squares[key], group.redundancy};
    const auto known = known_sigma(state.rig, key, options);
    if (known && !options.estimate_known_sigmas) {
      group.sigma_px = *known;
      group.sigma_estimated = false;
      continue;
    }
    group.sigma_estimated = own.redundancy >= options.minimum_redundancy;
    const double kept = options.reject_outliers ? kept_variance(d, options.gate) : 1;
    group.sigma_px = group.sigma_estimated ? std::max(std::sqrt(own.square / (own.redundancy * kept)), kSigmaFloor_px)
                                           : known.value_or(options.prior_sigma_px);
    if (group.sigma_estimated) result.freedoms[key] = own.redundancy;
  }
  return result;
}

ViewSummary summarise_view(const View& view, const Eigen::VectorXd& residuals_px, const ViewWeights& weights) {
  ViewSummary summary{
      view.sensor(), view.placement(), view.station(), view.kind(), 0, 0, weights.inlier, residuals_px, {}, {}};
  const int d = view.dimension();
  double accepted_square = 0;
  int accepted = 0;
  for (int i = 0; i < view.size(); ++i) {
    if (!weights.inlier[static_cast<std::size_t>(i)]) continue;
    accepted_square += residuals_px.segment(d * i, d).squaredNorm();
    ++accepted;
  }
  summary.rms_px = accepted > 0 ? std::sqrt(accepted_square / accepted) : 0;
  summary.rms_all_px = view.size() > 0 ? std::sqrt(residuals_px.squaredNorm() / view.size()) : 0;
  return summary;
}

// Of one view's observations, as they count; `sigma_px` is the group's.
void add_tests(const View& view, const std::vector<Eigen::Matrix2d>& hats, double sigma_px, const Gates& gates,
               const std::function<bool(int)>& dispensable, ViewSummary& summary) {
  const int d = view.dimension();
  for (int i = 0; i < view.size(); ++i) {
    const Eigen::Matrix2d& hat = hats[static_cast<std::size_t>(i)];
    const bool inlier = summary.inlier[static_cast<std::size_t>(i)] != 0;
    const Eigen::VectorXd whitened = summary.residuals_px.segment(d * i, d) / sigma_px;
    const GateTest test = gate_test(whitened, hat, inlier, dispensable(i), gates);
    summary.standardised.push_back(static_cast<float>(std::sqrt(test.square)));
    summary.redundancy.push_back(inlier ? static_cast<float>(d - hat.trace())
                                        : std::numeric_limits<float>::quiet_NaN());
  }
}

// A gross error e raises the expected standardised square by e' (I - J C J') e / sigma^2, the least eigenvalue's share
// where it shows least.
void add_gross_errors(const Views& views, const Linearisation& at, const std::vector<ViewWeights>& weights,
                      const std::map<GroupKey, Gates>& gates, std::vector<GroupSummary>& groups) {
  constexpr double kSeen = 0.8;
  constexpr double kTestable = 1e-6;
  std::map<GroupKey, std::vector<float>> least;
  for (std::size_t v = 0; v < views.size(); ++v) {
    std::vector<float>& of_group = least[key_of(*views[v])];
    for (std::size_t i = 0; i < at.hats[v].size(); ++i) {
      if (!weights[v].inlier[i]) continue;
      // In one dimension the second row of the hat block is zero.
      of_group.push_back(
          static_cast<float>(symmetric_eigen2(Eigen::Matrix2d::Identity() - at.hats[v][i]).values.minCoeff()));
    }
  }
  for (GroupSummary& group : groups) {
    const GroupKey key(group.sensor, group.kind);
    const int d = View::dimension_of(group.kind);
    const double limit = gates.at(key).counted[static_cast<std::size_t>(d - 1)];
    group.standardised_limit = std::sqrt(limit);
    std::vector<float>& shares = least.at(key);
    if (shares.empty()) continue;
    const auto middle = shares.begin() + static_cast<std::ptrdiff_t>(shares.size() / 2);
    std::nth_element(shares.begin(), middle, shares.end());
    if (*middle > kTestable)
      group.gross_error_px = group.sigma_px * std::sqrt(noncentrality_seen(limit, d, kSeen) / *middle);
  }
}

// Those with accepted observations.
std::vector<const View*> accepted_views(const Views& views, const std::vector<ViewWeights>& weights) {
  std::vector<const View*> accepted;
  for (std::size_t v = 0; v < views.size(); ++v) {
    const auto& inlier = weights[v].inlier;
    if (std::any_of(inlier.begin(), inlier.end(), [](char c) { return c != 0; })) accepted.push_back(views[v].get());
  }
  return accepted;
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

double inflation_of(View::Kind kind, const BundleOptions& options) {
  switch (kind) {
    case View::Kind::corners:
      return options.corner_inflation;
    case View::Kind::stripes:
      return options.stripe_inflation;
    case View::Kind::overlaps:
      return options.overlap_inflation;
    case View::Kind::features:
    case View::Kind::leds:
      break;
  }
  return 1;
}

std::string group_name(const Rig& rig, std::size_t sensor, View::Kind kind) {
  return fmt::format("{}.{}", rig.sensors[sensor].name, name_of(kind));
}

namespace {

// The frames of probe and world: those of the first sensor on each. Where nothing is fixed to the world, the first
// placement holds it; where the probe carries no sensor, the first station holds the probe.
void hold_gauge(const CalibrationState& state, const Views& views, std::set<BlockId>& held) {
  const auto& sensors = state.rig.sensors;
  const auto first_on = [&](Mount mount) -> std::optional<std::size_t> {
    const auto found = std::find_if(sensors.begin(), sensors.end(), [&](const Sensor& s) { return s.mount == mount; });
    if (found == sensors.end()) return std::nullopt;
    return static_cast<std::size_t>(found - sensors.begin());
  };
  const auto hold_first = [&](BlockId::Kind kind) {
    std::set<BlockId> blocks;
    for (const auto& view : views) {
      for (const BlockId& block : view->blocks()) {
        if (block.kind == kind) blocks.insert(block);
      }
    }
    if (!blocks.empty()) held.insert(*blocks.begin());
  };
  const auto on_probe = first_on(Mount::probe), in_world = first_on(Mount::world);
  if (on_probe) held.insert({BlockId::Kind::mount, *on_probe});
  if (in_world) held.insert({BlockId::Kind::mount, *in_world});
  if (state.world_from_probe.empty()) return;
  if (!on_probe) hold_first(BlockId::Kind::station);
  if (!in_world) hold_first(BlockId::Kind::placement);
}

bool has_prior(const BlockId& block, const std::vector<Prior>& priors) {
  return std::any_of(priors.begin(), priors.end(), [&](const Prior& prior) {
    return std::find(prior.blocks().begin(), prior.blocks().end(), block) != prior.blocks().end();
  });
}

}  // namespace

Expected<BundleResult> refine(const CalibrationState& start, const Observations& observations,
                              const BundleOptions& options) {
  const Views views = make_views(observations, start.board_of);
  CalibrationState state = start;
  std::set<BlockId> held = options.held;
  hold_gauge(state, views, held);
  for (const BlockId& block : options.freed) held.erase(block);
  for (std::size_t b = 0; b < start.boards.size(); ++b) {
    if (!options.estimate_warp) held.insert({BlockId::Kind::warp, b});
    if (!has_prior({BlockId::Kind::scale, b}, options.priors)) held.insert({BlockId::Kind::scale, b});
  }
  std::vector<ViewWeights> weights;
  for (const auto& view : views) {
    weights.push_back(
        {1, inflation_of(view->kind(), options), std::vector<char>(static_cast<std::size_t>(view->size()), 1)});
  }
  DispensableLeds dispensable(observations, options.dispensable_leds, options.held, options.priors);
  dispensable.settle(false, weights, held);
  Parameters parameters(state, views, held, options.priors);

  if (const auto done = robust_stage(start, views, parameters, options, weights, state); !done) {
    return tl::unexpected(done.error());
  }
  if (options.reject_outliers) {
    const NormalEquations equations = equations_at(views, weights, parameters, state, options);
    const auto at = linearise(views, weights, equations, state, options);
    if (!at) return tl::unexpected(at.error());
    gate_outliers(views, *at, gates_of(views, {}, options.gate), dispensable, true, weights);
    dispensable.keep_needed(weights);
    settle_untold_poses(views, observations, true, weights, state, held);
    if (dispensable.settle(true, weights, held)) parameters = Parameters(state, views, held, options.priors);
  }
  MinimiseOptions minimise_options{.threads = options.threads, .priors = options.priors, .tolerance = kRoundTolerance};
  constexpr double last_tolerance = MinimiseOptions().tolerance;
  std::set<GroupKey> small;
  for (int round = 1;; ++round) {
    const auto minimum = minimise(views, weights, parameters, minimise_options, state);
    if (!minimum) return tl::unexpected(minimum.error());
    auto at = linearise(views, weights, minimum->equations, state, options);
    if (!at) return tl::unexpected(at.error());
    const auto [groups, freedoms] = summarise_groups(views, *at, weights, state, options, small);
    const std::map<GroupKey, Gates> gates = gates_of(views, freedoms, options.gate);
    const bool same_sigmas = settled(views, weights, sigmas_of(groups));
    std::vector<ViewWeights> next = weights;
    set_sigmas(views, sigmas_of(groups), next);
    bool other_blocks = false;
    if (options.reject_outliers) {
      gate_outliers(views, *at, gates, dispensable, round < kReadmittingRounds, next);
      dispensable.keep_needed(next);
      const bool try_again = round < kRetrialRounds;
      const bool fewer = dispensable.settle(try_again, next, held);
      const bool other_poses = settle_untold_poses(views, observations, try_again, next, state, held);
      other_blocks = dispensable.settle(false, next, held) || other_poses || fewer;
    }
    const bool unchanged = same_sides(weights, next) && same_sigmas && !other_blocks;
    const bool to_the_end = minimise_options.tolerance == last_tolerance;
    if ((unchanged && to_the_end) || round == kMaxRounds) {
      at->covariance.sharpen(views, whitened_at(views, weights, state), options.priors, state, options.threads);
      std::vector<Undetermined> undetermined = undetermined_terms(options.priors, at->covariance, state);
      TangentFunction body_motions = mean_body_motions(accepted_views(views, weights), state);
      BundleResult result{
          std::move(state),       {}, {}, std::move(at->covariance), round, unchanged, std::move(body_motions),
          std::move(undetermined)};
      for (const auto& [key, group] : groups) result.groups.push_back(group);
      add_gross_errors(views, *at, weights, gates, result.groups);
      for (std::size_t v = 0; v < views.size(); ++v) {
        result.views.push_back(summarise_view(*views[v], at->residuals_px[v], weights[v]));
        add_tests(
            *views[v], at->hats[v], next[v].sigma_px, gates.at(key_of(*views[v])),
            [&](int i) { return dispensable.reads(v, i); }, result.views.back());
      }
      return result;
    }
    if (unchanged || round + 1 == kMaxRounds) minimise_options.tolerance = last_tolerance;
    minimise_options.damping = other_blocks ? kFirstDamping : std::min(kFirstDamping, minimum->damping);
    weights = std::move(next);
    if (other_blocks) parameters = Parameters(state, views, held, options.priors);
  }
}

}  // namespace crumple
