#include "calib/uncertainty_budget.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <map>
#include <numbers>
#include <utility>

#include "calib/whitened_view.h"
#include "solvers/decompositions.h"
#include "solvers/parallel.h"

namespace crumple {
namespace {

constexpr double kRounding = 1e-9;  // shares below it are none
constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kDegrees = 180 / std::numbers::pi;

// The estimated blocks that are no poses, in the order of the covariance.
std::vector<BlockId> rig_blocks(const CalibrationState& state, const JointCovariance& covariance) {
  std::vector<BlockId> all, estimated;
  for (std::size_t s = 0; s < state.rig.sensors.size(); ++s) {
    if (!state.rig.sensors[s].lens_of) all.push_back({BlockId::Kind::lens, s});
    all.push_back({BlockId::Kind::mount, s});
  }
  for (std::size_t l = 0; l < state.rig.leds.size(); ++l) all.push_back({BlockId::Kind::led, l});
  for (std::size_t b = 0; b < state.boards.size(); ++b) {
    all.push_back({BlockId::Kind::warp, b});
    all.push_back({BlockId::Kind::scale, b});
  }
  const auto& names = covariance.names();
  const auto end = names.begin() + covariance.rig_rows();
  std::copy_if(all.begin(), all.end(), std::back_inserter(estimated), [&](const BlockId& block) {
    return std::find(names.begin(), end, parameter_names(block, state).front()) != end;
  });
  return estimated;
}

// The covariance of the rig with whatever an observation or a prior touches.
class RigGain {
 public:
  RigGain(const BundleResult& bundle, std::vector<BlockId> rig)
      : bundle_(bundle), rig_(std::move(rig)), rows_(width(rig_)) {}

  Eigen::Index rows() const { return rows_; }

  // The diagonal of C J' J C over the rig's rows: `information` is J' J by the tangents of `blocks`, side by side.
  Eigen::VectorXd share(const std::vector<BlockId>& blocks, const Eigen::MatrixXd& information) const {
    std::vector<BlockId> all = rig_;
    for (const BlockId& block : blocks) {
      if (std::find(all.begin(), all.end(), owner(block)) == all.end()) all.push_back(block);
    }
    const Eigen::MatrixXd joint = bundle_.covariance.before_widening(all, bundle_.state);
    Eigen::MatrixXd with_blocks(rows_, information.cols());
    Eigen::Index column = 0;
    for (const BlockId& block : blocks) {
      const auto at = std::find(all.begin(), all.end(), owner(block));
      const Eigen::Index size = tangent_size(block, bundle_.state);
      with_blocks.middleCols(column, size) = joint.block(0, width({all.begin(), at}), rows_, size);
      column += size;
    }
    return (with_blocks * information).cwiseProduct(with_blocks).rowwise().sum();
  }

 private:
  Eigen::Index width(const std::vector<BlockId>& blocks) const {
    Eigen::Index columns = 0;
    for (const BlockId& block : blocks) columns += tangent_size(block, bundle_.state);
    return columns;
  }
  BlockId owner(const BlockId& block) const {
    if (block.kind != BlockId::Kind::lens) return block;
    return {block.kind, bundle_.state.rig.sensors[block.index].lens_of.value_or(block.index)};
  }

  const BundleResult& bundle_;
  std::vector<BlockId> rig_;
  Eigen::Index rows_;
};

// The shares of the observations, one column per group in the bundle's order.
Eigen::MatrixXd group_shares(const Observations& observations, const Calibration& calibration, const RigGain& gain,
                             int threads) {
  const BundleResult& bundle = calibration.bundle;
  const auto views = make_views(observations, bundle.state.board_of);
  std::map<std::pair<std::size_t, View::Kind>, Eigen::Index> columns;
  for (const GroupSummary& group : bundle.groups) {
    columns.emplace(std::pair(group.sensor, group.kind), static_cast<Eigen::Index>(columns.size()));
  }
  std::vector<Eigen::VectorXd> of_view(views.size());
  parallel_for(views.size(), threads, [&](std::size_t v) {
    of_view[v] = Eigen::VectorXd::Zero(gain.rows());
    ViewEvaluation evaluation;
    if (!counted(calibration, v) || !whitened_view(calibration, *views[v], v, evaluation)) return;
    const Eigen::MatrixXd local = evaluation.jacobian.transpose() * evaluation.jacobian;
    const Eigen::MatrixXd& from_blocks = evaluation.local_from_blocks;
    of_view[v] = gain.share(views[v]->blocks(), from_blocks.transpose() * local * from_blocks);
  });
  Eigen::MatrixXd shares = Eigen::MatrixXd::Zero(gain.rows(), static_cast<Eigen::Index>(columns.size()));
  for (std::size_t v = 0; v < views.size(); ++v) {
    shares.col(columns.at({views[v]->sensor(), views[v]->kind()})) += of_view[v];
  }
  return shares;
}

Eigen::VectorXd prior_share(const Prior& prior, const CalibrationState& state, const RigGain& gain) {
  const WhitenedPrior whitened = prior.evaluate(state);
  Eigen::MatrixXd jacobian(whitened.residuals.size(), 0);
  for (const RowMajorMatrix& block : whitened.jacobians) {
    jacobian.conservativeResize(Eigen::NoChange, jacobian.cols() + block.cols());
    jacobian.rightCols(block.cols()) = block;
  }
  return gain.share(prior.blocks(), jacobian.transpose() * jacobian);
}

// One parameter of the rig, before its uncertainty is known.
struct Term {
  std::string part;
  std::string unit;
  double value = 0;
  double per_tangent = 1;  // from the tangent's unit to the entry's
};

void add_lens(const Sensor& sensor, std::vector<Term>& terms) {
  const std::vector<std::string> names = lens_parameter_names(sensor.lens.model());
  for (std::size_t i = 0; i < names.size(); ++i) {
    const bool angle = names[i] == "alpha" || names[i] == "beta";
    terms.push_back({"lens of " + sensor.name, i < 4 ? "px" : (angle ? "rad" : ""), sensor.lens.parameters()[i]});
  }
}

void add_lengths(const std::string& part, const Eigen::VectorXd& values_mm, std::vector<Term>& terms) {
  for (const double value : values_mm) terms.push_back({part, "mm", value});
}

std::vector<Term> terms_of(const std::vector<BlockId>& blocks, const CalibrationState& state) {
  std::vector<Term> terms;
  for (const BlockId& block : blocks) {
    if (block.kind == BlockId::Kind::lens) add_lens(state.rig.sensors[block.index], terms);
    if (block.kind == BlockId::Kind::mount) {
      const Sensor& sensor = state.rig.sensors[block.index];
      const std::string part = "mount of " + sensor.name;
      const Eigen::Vector3d vector_deg = rotation_vector(sensor.sensor_from_mount.rotation) * kDegrees;
      for (const double value : vector_deg) terms.push_back({part, "deg", value, kDegrees});
      add_lengths(part, sensor.sensor_from_mount.translation, terms);
    }
    if (block.kind == BlockId::Kind::led) {
      const Led& led = state.rig.leds[block.index];
      add_lengths("LED " + led.name, led.position_mm, terms);
    }
    if (block.kind == BlockId::Kind::warp) {
      add_lengths(state.boards[block.index].name, state.boards[block.index].warp_mm, terms);
    }
    if (block.kind == BlockId::Kind::scale) {
      terms.push_back({state.boards[block.index].name, "", state.boards[block.index].scale});
    }
  }
  return terms;
}

// `shares`: what each source adds to the variance of the tangent.
BudgetEntry entry_of(const Term& term, const std::string& name, double variance, const Eigen::RowVectorXd& shares,
                     const std::vector<BudgetSource>& sources) {
  BudgetEntry entry{term.part, name, term.unit, term.value, std::sqrt(variance) * term.per_tangent};
  for (std::size_t s = 0; s < sources.size(); ++s) {
    const double share = shares[static_cast<Eigen::Index>(s)] / variance;
    entry.shares.push_back(share);
    if (sources[s].type_b) entry.type_b_share += share;
  }
  entry.degrees_of_freedom = effective_degrees_of_freedom(sources, entry.shares);
  return entry;
}

// What regions are made of, by the budget's entries: the covariance before weights and outlier rule widened it, and
// what each estimated variance contributes to it.
struct RegionParts {
  Eigen::MatrixXd covariance;
  std::vector<Eigen::MatrixXd> shares;
  const VarianceEstimates& estimates;
};

RegionParts region_parts(const Calibration& calibration, const std::vector<std::optional<Eigen::Index>>& own_rows) {
  const Eigen::MatrixXd& widening = calibration.bundle.covariance.widening();
  const auto rows = static_cast<Eigen::Index>(own_rows.size());
  RegionParts parts{whole_covariance(calibration).common().topLeftCorner(rows, rows), {}, calibration.variances};
  const auto own = [&](const Eigen::MatrixXd& of_bundle) {
    Eigen::MatrixXd all = Eigen::MatrixXd::Zero(rows, rows);
    for (Eigen::Index i = 0; i < rows; ++i) {
      for (Eigen::Index j = 0; j < rows; ++j) {
        const auto &a = own_rows[static_cast<std::size_t>(i)], &b = own_rows[static_cast<std::size_t>(j)];
        if (a && b) all(i, j) = of_bundle(*a, *b);
      }
    }
    return all;
  };
  if (widening.size() > 0) parts.covariance -= own(widening);
  for (const Eigen::MatrixXd& share : calibration.variances.shares) parts.shares.push_back(own(share));
  return parts;
}

// Kenward and Roger's, in their letters. `rows`: of the entries.
BudgetRegion region_of(const std::string& part, const std::vector<Eigen::Index>& rows, const RegionParts& parts) {
  const VarianceEstimates& estimates = parts.estimates;
  const Eigen::MatrixXd covariance = parts.covariance(rows, rows);
  std::vector<Eigen::MatrixXd> shares;  // of the whitened parameters
  for (const Eigen::MatrixXd& share : parts.shares) shares.push_back(solve_symmetric(covariance, share(rows, rows)));
  double a1 = 0, a2 = 0;
  for (std::size_t i = 0; i < shares.size(); ++i) {
    for (std::size_t j = 0; j < shares.size(); ++j) {
      const double w =
          2 * estimates.half_relative_covariance(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j));
      a1 += w * shares[i].trace() * shares[j].trace();
      a2 += w * shares[i].cwiseProduct(shares[j].transpose()).sum();
    }
  }
  const auto l = static_cast<double>(rows.size());
  BudgetRegion region{part, static_cast<int>(rows.size())};
  region.degrees_of_freedom = kInfinity;
  if (!(a2 > kRounding)) return region;
  const double b = (a1 + 6 * a2) / (2 * l);
  const double g = ((l + 1) * a1 - (l + 4) * a2) / ((l + 2) * a2);
  const double divisor = 3 * l + 2 * (1 - g);
  const double c1 = g / divisor, c2 = (l - g) / divisor, c3 = (l + 2 - g) / divisor;
  region.mean = 1 / (1 - a2 / l);
  const double variance = 2 / l * (1 + c1 * b) / ((1 - c2 * b) * (1 - c2 * b) * (1 - c3 * b));
  const double rho = variance / (2 * region.mean * region.mean);
  region.degrees_of_freedom = l * rho > 1 ? 4 + (l + 2) / (l * rho - 1) : kInfinity;
  region.scale = std::isfinite(region.degrees_of_freedom)
                     ? region.degrees_of_freedom / (region.mean * (region.degrees_of_freedom - 2))
                     : 1 / region.mean;
  return region;
}

// Of each part, of the LEDs, of all.
std::vector<BudgetRegion> regions_of(const std::vector<BudgetEntry>& entries, const RegionParts& of_entries) {
  std::vector<std::pair<std::string, std::vector<Eigen::Index>>> parts;
  const auto rows_of = [&](const std::string& part) -> std::vector<Eigen::Index>& {
    const auto found = std::find_if(parts.begin(), parts.end(), [&](const auto& p) { return p.first == part; });
    return found != parts.end() ? found->second : parts.emplace_back(part, std::vector<Eigen::Index>{}).second;
  };
  for (std::size_t i = 0; i < entries.size(); ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    rows_of(entries[i].part).push_back(row);
    if (entries[i].part.rfind("LED ", 0) == 0) rows_of("LEDs").push_back(row);
    rows_of("all").push_back(row);
  }
  std::vector<BudgetRegion> regions;
  for (const auto& [part, rows] : parts) regions.push_back(region_of(part, rows, of_entries));
  return regions;
}

}  // namespace

std::vector<BudgetSource> budget_sources(const Calibration& calibration) {
  const BundleResult& bundle = calibration.bundle;
  const VarianceEstimates& estimates = calibration.variances;
  const auto estimate_of = [&](std::size_t group) -> std::optional<Eigen::Index> {
    if (estimates.of_group.empty() || !estimates.of_group[group]) return std::nullopt;
    return static_cast<Eigen::Index>(*estimates.of_group[group]);
  };
  std::vector<BudgetSource> sources;
  for (std::size_t g = 0; g < bundle.groups.size(); ++g) {
    const GroupSummary& group = bundle.groups[g];
    BudgetSource source{group_name(bundle.state.rig, group.sensor, group.kind), !group.sigma_estimated};
    source.kind = group.kind;
    source.inflation_degrees_of_freedom = calibration.inflation.degrees_of_freedom(group.kind);
    if (const auto own = estimate_of(g)) {
      source.sigma_degrees_of_freedom = 1 / estimates.half_relative_covariance(*own, *own);
      for (std::size_t other = 0; other < bundle.groups.size(); ++other) {
        const auto its = estimate_of(other);
        source.sigma_covariance.push_back(its ? estimates.half_relative_covariance(*own, *its) : 0.0);
      }
    }
    sources.push_back(std::move(source));
  }
  for (const Prior& prior : calibration.priors) sources.push_back({prior.name(), true});
  if (bundle.covariance.widening().size() > 0) sources.push_back({"weights and outlier rule"});
  if (calibration.with_kept) sources.push_back({"kept parts", true});
  return sources;
}

double effective_degrees_of_freedom(const std::vector<BudgetSource>& sources, const std::vector<double>& shares) {
  double inverse = 0;
  std::map<View::Kind, double> shares_of_kind;
  for (std::size_t s = 0; s < sources.size(); ++s) {
    if (!(shares[s] > kRounding)) continue;
    for (std::size_t other = 0; other < sources[s].sigma_covariance.size(); ++other) {
      inverse += shares[s] * std::max(shares[other], 0.0) * sources[s].sigma_covariance[other];
    }
    if (sources[s].kind) shares_of_kind[*sources[s].kind] += shares[s];
  }
  for (const auto& [kind, share] : shares_of_kind) {
    const auto any = std::find_if(sources.begin(), sources.end(), [k = kind](const auto& s) { return s.kind == k; });
    inverse += share * share / any->inflation_degrees_of_freedom;
  }
  return inverse > 0 ? 1 / inverse : kInfinity;
}

UncertaintyBudget uncertainty_budget(const Observations& observations, const Calibration& calibration, int threads) {
  const BundleResult& bundle = calibration.bundle;
  const RigGain gain(bundle, rig_blocks(bundle.state, bundle.covariance));
  UncertaintyBudget budget{budget_sources(calibration), {}};
  Eigen::MatrixXd shares = Eigen::MatrixXd::Zero(gain.rows(), static_cast<Eigen::Index>(budget.sources.size()));
  const auto groups = static_cast<Eigen::Index>(bundle.groups.size());
  shares.leftCols(groups) = group_shares(observations, calibration, gain, threads);
  for (std::size_t p = 0; p < calibration.priors.size(); ++p) {
    shares.col(groups + static_cast<Eigen::Index>(p)) = prior_share(calibration.priors[p], bundle.state, gain);
  }
  const Eigen::MatrixXd& widening = bundle.covariance.widening();
  const Eigen::Index last = groups + static_cast<Eigen::Index>(calibration.priors.size());
  if (widening.size() > 0) shares.col(last) = widening.diagonal().head(gain.rows());
  const JointCovariance& whole = whole_covariance(calibration);
  const std::vector<std::string>& own_names = bundle.covariance.names();
  std::vector<std::optional<Eigen::Index>> own_rows;
  Eigen::Index row = 0;
  for (const Term& term : terms_of(rig_blocks(bundle.state, whole), bundle.state)) {
    const std::string& name = whole.names()[static_cast<std::size_t>(row)];
    const double variance = whole.common()(row, row);
    const auto own = std::find(own_names.begin(), own_names.begin() + gain.rows(), name) - own_names.begin();
    own_rows.push_back(own < gain.rows() ? std::optional<Eigen::Index>(own) : std::nullopt);
    Eigen::RowVectorXd of_row = Eigen::RowVectorXd::Zero(shares.cols());
    if (own_rows.back()) of_row = shares.row(own);
    // What was kept adds the rest.
    if (calibration.with_kept) of_row[of_row.size() - 1] = variance - of_row.sum();
    budget.entries.push_back(entry_of(term, name, variance, of_row, budget.sources));
    ++row;
  }
  budget.regions = regions_of(budget.entries, region_parts(calibration, own_rows));
  return budget;
}

}  // namespace crumple
