#include "calib/fold_differences.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "calib/rig_difference.h"
#include "calib/whitened_view.h"
#include "solvers/decompositions.h"
#include "solvers/distribution_tails.h"
#include "solvers/normal_equations.h"
#include "solvers/rig_covariance.h"
#include "solvers/square_root.h"

namespace crumple {
namespace {

constexpr std::size_t kFolds = 5;
constexpr std::size_t kFewest = 3;    // of a kind, to leave any of it out
constexpr double kFalseAlarm = 1e-3;  // over all quantities together
constexpr double kMuch = 2;           // times what is expected
// Differences are compared a hundred times smaller than they are, covariances and floors likewise: what a pixel's
// change in one direction is to second order would be much in another that is known better.
constexpr double kShrunk = 0.01;
// Of what counts as none between two rigs: there is no second order here.
constexpr double kNoDifference = 0.1;
constexpr std::size_t kNamesToTell = 4;  // of what a fold leaves out

// What is left out as a whole: a station with all that is seen there, or a placement seen without one.
struct Unit {
  bool station = false;
  std::size_t index = 0;
  auto operator<=>(const Unit&) const = default;
};

std::optional<Unit> unit_of(const std::optional<std::size_t>& station, const std::optional<std::size_t>& placement) {
  if (station) return Unit{true, *station};
  if (placement) return Unit{false, *placement};
  return std::nullopt;
}

// By view, in the order of make_views; none for what is fixed to the room.
std::vector<std::optional<Unit>> units_of_views(const Observations& observations) {
  std::vector<std::optional<Unit>> units;
  for (const CornerView& view : observations.corners) units.push_back(unit_of(view.station, view.placement));
  for (const StripeView& view : observations.stripes) units.push_back(unit_of(view.station, view.placement));
  for (const FeatureView& view : observations.features) units.push_back(unit_of(view.station, view.placement));
  for (const LedView& view : observations.leds) units.push_back(unit_of(view.station, std::nullopt));
  return units;
}

// Units whose pose was estimated: one that holds the frame stays. Every fifth one, and fifths in a row: what changed in
// the course of a campaign is spread evenly over the former.
std::vector<std::set<Unit>> folds_of(const Observations& observations, const Parameters& parameters) {
  std::map<bool, std::set<Unit>> kinds;  // by Unit::station
  for (const auto& unit : units_of_views(observations)) {
    if (!unit) continue;
    const BlockId pose{unit->station ? BlockId::Kind::station : BlockId::Kind::placement, unit->index};
    if (parameters.estimated(pose)) kinds[unit->station].insert(*unit);
  }
  std::vector<std::set<Unit>> folds(2 * kFolds);
  for (const auto& [station, units] : kinds) {
    if (units.size() < kFewest) continue;
    std::size_t dealt = 0;
    for (const Unit& unit : units) {
      folds[dealt % kFolds].insert(unit);
      folds[kFolds + dealt * kFolds / units.size()].insert(unit);
      ++dealt;
    }
  }
  std::vector<std::set<Unit>> different;
  for (const std::set<Unit>& fold : folds) {
    if (!fold.empty() && std::find(different.begin(), different.end(), fold) == different.end())
      different.push_back(fold);
  }
  return different;
}

std::vector<std::string> names_of(const std::set<Unit>& fold, const CalibrationData& data) {
  std::vector<std::string> names;
  for (const Unit& unit : fold) {
    names.push_back(unit.station ? data.station_names[unit.index] : data.placement_names[unit.index]);
  }
  return names;
}

// Refinements of parts of the data, one Gauss-Newton step from the calibration's result each, with its weights,
// outliers and priors. All have their covariance from there: at places of their own they would differ by more than the
// parts do, where directions that are hardly known turn a little.
class Parts {
 public:
  Parts(const CalibrationData& data, const Calibration& calibration, int threads)
      : calibration_(calibration),
        observations_(data.observations),
        units_(units_of_views(data.observations)),
        threads_(threads) {
    const Parameters& all = calibration.bundle.covariance.parameters();
    for (const auto& view : make_views(data.observations, data.board_of)) {
      for (const BlockId& block : view->blocks()) {
        if (!all.estimated(block)) held_.insert(block);
      }
    }
  }

  // The rig without a fold.
  Expected<Rig> without(const std::set<Unit>& fold) const {
    const CalibrationState& state = calibration_.bundle.state;
    std::vector<std::unique_ptr<View>> views;
    std::vector<std::size_t> numbers;
    auto all = make_views(observations_, state.board_of);
    for (std::size_t v = 0; v < all.size(); ++v) {
      if (!counted(calibration_, v) || (units_[v] && fold.contains(*units_[v]))) continue;
      views.push_back(std::move(all[v]));
      numbers.push_back(v);
    }
    const Parameters parameters(state, views, held_);
    if (const auto seen = check_seen(parameters); !seen) return tl::unexpected(seen.error());
    const NormalEquations::Evaluate evaluate = [&](std::size_t i, ViewEvaluation& at) {
      return whitened_view(calibration_, *views[i], numbers[i], at);
    };
    auto equations = NormalEquations::of(views, parameters, evaluate, threads_);
    if (!equations) return fail("its views cannot be predicted");
    for (const Prior& prior : calibration_.priors) equations->add(prior, state);
    std::function<Eigen::MatrixXd()> square_root;
    if (std::any_of(calibration_.priors.begin(), calibration_.priors.end(),
                    [](const Prior& prior) { return prior.weak(); })) {
      square_root = [&] {
        return reduced_square_root(views, parameters, evaluate, calibration_.priors, state, threads_);
      };
    }
    const auto covariance = JointCovariance::create(*equations, state, square_root);
    if (!covariance) return tl::unexpected(covariance.error());
    Rig rig = moved(state, parameters, kShrunk * step(*equations, *covariance)).rig;
    rig.covariance = covariance->of_rig_and({});
    rig.covariance.matrix *= kShrunk * kShrunk;
    return rig;
  }

 private:
  // Of the common parameters, by the covariance, which is good where the equations are too near to singular to be
  // solved.
  static Eigen::VectorXd step(const NormalEquations& equations, const JointCovariance& covariance) {
    Eigen::VectorXd gradient = equations.common_gradient();
    for (std::size_t p = 0; p < equations.eliminated().size(); ++p) {
      gradient -= covariance.gain(p) * equations.eliminated()[p].gradient;
    }
    Eigen::VectorXd step = Eigen::VectorXd::Zero(equations.parameters().size());
    step.head(gradient.size()) = -covariance.common() * gradient;
    return step;
  }

  // Of the rig, estimated from all views; the part would hold it where they put it.
  Expected<void> check_seen(const Parameters& parameters) const {
    const JointCovariance& all = calibration_.bundle.covariance;
    for (const BlockId& block : all.parameters().common_blocks()) {
      if (block.is_pose() || parameters.estimated(block)) continue;
      return fail(
          fmt::format("nothing is left that tells {}", parameter_names(block, calibration_.bundle.state).front()));
    }
    return {};
  }

  const Calibration& calibration_;
  const Observations& observations_;
  std::vector<std::optional<Unit>> units_;
  std::set<BlockId> held_;
  int threads_;
};

// The part of a symmetric matrix that is a covariance: where two are equal their difference is rounding.
Eigen::MatrixXd positive_part(const Eigen::MatrixXd& difference, const Eigen::VectorXd& sigmas) {
  const Eigen::VectorXd inverse = sigmas.unaryExpr([](double s) { return s > 0 ? 1 / s : 0.0; });
  const SymmetricEigen eigen = symmetric_eigen(inverse.asDiagonal() * difference * inverse.asDiagonal());
  const Eigen::MatrixXd root =
      sigmas.asDiagonal() * (eigen.vectors * eigen.values.cwiseMax(0).cwiseSqrt().asDiagonal());
  return root * root.transpose();
}

// All views' rig and that of a part of them, with the covariance of their difference: none in the one, all of it in the
// other.
Expected<RigDifference> nested_difference(Rig whole, Rig part) {
  const RigCovariance all = whole.covariance;
  RigCovariance& of_part = part.covariance;
  const Eigen::VectorXd sigmas = of_part.matrix.diagonal().cwiseSqrt();
  of_part.matrix = positive_part(of_part.matrix - covariance_of(all, of_part.names), sigmas);
  whole.covariance.matrix.setZero();
  return rig_difference(whole, part,
                        {.no_difference_px = kNoDifference * kShrunk * kNoDifference_px,
                         .no_difference_mm = kNoDifference * kShrunk * kNoDifference_mm});
}

// Of the variance that is known least.
double least_freedom(const VarianceEstimates& variances) {
  double freedom = std::numeric_limits<double>::infinity();
  for (const double half : variances.half_relative_covariance.diagonal()) freedom = std::min(freedom, 1 / half);
  return freedom;
}

// Gathers the folds' differences. `freedom` is that of the variances.
class Gathered {
 public:
  explicit Gathered(double freedom) : freedom_(freedom) {}

  void add(std::size_t fold, const RigDifference& difference) {
    ++folds_;
    for (const SensorDrift& sensor : difference.sensors) add(fold, sensor.sensor, "px", sensor.projection.px);
    for (const PairDrift& pair : difference.pairs) add(fold, pair.first + " " + pair.second, "mm", pair.volume.mm);
    if (!difference.leds) return;
    const LedDrift& leds = *difference.leds;
    add(fold, "LEDs", "mm", leds.leds.mm);
    if (leds.leds.of_measured) {
      add(fold, fmt::format("LEDs against {} {}", leds.first, leds.second), "mm", leds.leds.of_measured->mm);
    }
  }

  std::vector<FoldedQuantity> quantities() const {
    std::vector<FoldedQuantity> all = quantities_;
    for (std::size_t i = 0; i < all.size(); ++i) {
      all[i].rms = std::sqrt(sums_[i].square / sums_[i].count);
      all[i].expected_rms = std::sqrt(sums_[i].expected_square / sums_[i].count);
      all[i].ratio = all[i].expected_rms > 0 ? all[i].rms / all[i].expected_rms : 0;
      all[i].probability = std::min(1.0, all[i].probability * folds_);
    }
    return all;
  }

 private:
  struct Sums {
    double square = 0, expected_square = 0;
    double count = 0;  // of folds
  };

  void add(std::size_t fold, const std::string& name, const std::string& unit, const AlignedDifference& d) {
    if (!(d.expected_rms() > 0)) return;  // the fold's views say nothing of it
    const auto found = std::find_if(quantities_.begin(), quantities_.end(),
                                    [&](const FoldedQuantity& quantity) { return quantity.name == name; });
    const auto at = static_cast<std::size_t>(found - quantities_.begin());
    if (found == quantities_.end()) {
      quantities_.push_back({.name = name, .unit = unit});
      sums_.emplace_back();
    }
    sums_[at].square += std::pow(d.rms() / kShrunk, 2);
    sums_[at].expected_square += std::pow(d.expected_rms() / kShrunk, 2);
    ++sums_[at].count;
    // Where all that is expected is below what counts as none.
    const bool below = d.degrees == 0;
    const double ratio = below ? d.rms() / std::max(d.floor, d.expected_rms()) : std::sqrt(d.statistic / d.degrees);
    const double probability = below ? (ratio > kMuch ? 0 : 1) : f_tail(ratio * ratio, d.degrees, freedom_);
    FoldedQuantity& quantity = quantities_[at];
    if (sums_[at].count > 1 && probability >= quantity.probability) return;
    quantity.probability = probability;
    quantity.clearest = fold;
    quantity.clearest_ratio = ratio;
  }

  double freedom_;
  std::vector<FoldedQuantity> quantities_;
  std::vector<Sums> sums_;
  int folds_ = 0;
};

std::string some_of(const std::vector<std::string>& names) {
  const std::vector<std::string> first(
      names.begin(), names.begin() + static_cast<std::ptrdiff_t>(std::min(names.size(), kNamesToTell)));
  return fmt::format("{}{}", fmt::join(first, ", "),
                     names.size() > kNamesToTell ? fmt::format(" and {} more", names.size() - kNamesToTell) : "");
}

}  // namespace

std::size_t fold_steps(const Observations& observations, const Calibration& calibration) {
  const std::size_t folds = folds_of(observations, calibration.bundle.covariance.parameters()).size();
  return folds > 0 ? folds + 1 : 0;
}

Expected<FoldDifferences> fold_differences(const CalibrationData& data, const Calibration& calibration, int threads,
                                           const std::function<void()>& report) {
  assert(!calibration.earlier);
  const std::vector<std::set<Unit>> folds = folds_of(data.observations, calibration.bundle.covariance.parameters());
  if (folds.empty()) return fail("cross-validation wants three stations, or three placements of a board");
  const Parts parts(data, calibration, threads);
  const auto whole = parts.without({});
  report();
  if (!whole) return tl::unexpected(whole.error());
  FoldDifferences result;
  Gathered gathered(least_freedom(calibration.variances));
  std::set<std::string> not_compared;
  for (const std::set<Unit>& fold : folds) {
    const auto part = parts.without(fold);
    report();
    const auto difference = part ? nested_difference(*whole, *part) : tl::unexpected(part.error());
    result.folds.push_back({names_of(fold, data), difference ? "" : difference.error().message});
    if (!difference) continue;
    gathered.add(result.folds.size() - 1, *difference);
    not_compared.insert(difference->not_compared.begin(), difference->not_compared.end());
  }
  result.quantities = gathered.quantities();
  result.not_compared.assign(not_compared.begin(), not_compared.end());
  if (result.quantities.empty()) {
    const Fold& first = result.folds.front();
    return fail(fmt::format("cross-validation compares nothing: without {}: {}", some_of(first.left_out),
                            first.not_done.empty() ? "the views left out tell nothing" : first.not_done));
  }
  return result;
}

std::vector<std::string> sentences_of(const FoldDifferences& differences) {
  std::vector<std::string> sentences;
  for (const Fold& fold : differences.folds) {
    if (fold.not_done.empty()) continue;
    sentences.push_back(fmt::format("without {} nothing is compared: {}", some_of(fold.left_out), fold.not_done));
  }
  for (const std::string& sentence : differences.not_compared) sentences.push_back("not compared: " + sentence);
  return sentences;
}

std::vector<std::string> reasons_of(const FoldDifferences& differences) {
  std::vector<std::string> reasons;
  for (const FoldedQuantity& quantity : differences.quantities) {
    const double by_chance = quantity.probability * static_cast<double>(differences.quantities.size());
    if (!(quantity.clearest_ratio > kMuch && by_chance < kFalseAlarm)) continue;
    reasons.push_back(fmt::format(
        "cross-validation: without {} {} changes by {:.1f} times what its uncertainty says: look at these views (a "
        "lens "
        "that was refocused? a board that was bent? something that moved?)",
        some_of(differences.folds[quantity.clearest].left_out),
        quantity.unit == "px" ? "what " + quantity.name + " sees" : quantity.name, quantity.clearest_ratio));
  }
  return reasons;
}

}  // namespace crumple
