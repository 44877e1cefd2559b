#include "solvers/prior.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <set>
#include <utility>

#include <fmt/format.h>

#include "solvers/decompositions.h"
#include "solvers/parameters.h"

namespace crumple {
namespace {

struct BlockDifference {
  Eigen::VectorXd value;
  Eigen::MatrixXd d_tangent;
};

BlockDifference difference_of(const BlockId& block, const CalibrationState& about, const CalibrationState& state) {
  BlockDifference difference{block_step(block, about, state), {}};
  difference.d_tangent = Eigen::MatrixXd::Identity(difference.value.size(), difference.value.size());
  if (block.is_pose() || block.kind == BlockId::Kind::mount) {
    difference.d_tangent.topLeftCorner<3, 3>() = inverse_left_jacobian(difference.value.head<3>());
  }
  return difference;
}

// L^-1 of L L' = covariance.
Expected<Eigen::MatrixXd> whitening_root(const std::string& name, const Eigen::MatrixXd& covariance) {
  auto root = inverse_cholesky_factor(covariance);
  if (!root || !covariance.allFinite()) {
    return fail(fmt::format("{}: its covariance is not positive definite", name));
  }
  return *std::move(root);
}

}  // namespace

Prior::Prior(std::string name, std::vector<PriorTerm> terms, CalibrationState about, Eigen::MatrixXd root)
    : name_(std::move(name)), terms_(std::move(terms)), about_(std::move(about)), root_(std::move(root)) {
  for (const PriorTerm& term : terms_) {
    if (std::find(blocks_.begin(), blocks_.end(), term.block) == blocks_.end()) blocks_.push_back(term.block);
  }
  assert(std::count_if(blocks_.begin(), blocks_.end(), [](const BlockId& block) { return block.is_pose(); }) <= 1);
}

Expected<Prior> Prior::create(std::string name, std::vector<PriorTerm> terms, CalibrationState about,
                              const Eigen::MatrixXd& covariance) {
  assert(covariance.rows() == static_cast<Eigen::Index>(terms.size()) && covariance.cols() == covariance.rows());
  if (std::set<PriorTerm>(terms.begin(), terms.end()).size() != terms.size()) {
    return fail(fmt::format("{}: a parameter is given twice", name));
  }
  auto root = whitening_root(name, covariance);
  if (!root) return tl::unexpected(root.error());
  return Prior(std::move(name), std::move(terms), std::move(about), std::move(*root));
}

Expected<Prior> Prior::of_distances(std::string name, std::vector<LedDistance> distances,
                                    const Eigen::MatrixXd& covariance) {
  assert(covariance.rows() == static_cast<Eigen::Index>(distances.size()) && covariance.cols() == covariance.rows());
  auto root = whitening_root(name, covariance);
  if (!root) return tl::unexpected(root.error());
  Prior prior(std::move(name), {}, {}, std::move(*root));
  std::set<std::size_t> leds;
  for (const LedDistance& distance : distances) {
    if (distance.from == distance.to) return fail(fmt::format("{}: a distance needs two LEDs", prior.name_));
    leds.insert({distance.from, distance.to});
  }
  for (const std::size_t led : leds) prior.blocks_.push_back({BlockId::Kind::led, led});
  prior.distances_ = std::move(distances);
  return prior;
}

Prior Prior::as_weak() const {
  Prior prior = *this;
  prior.weak_ = true;
  return prior;
}

Eigen::VectorXd Prior::sigmas() const { return inverse_lower(root_).rowwise().norm(); }

WhitenedPrior Prior::evaluate(const CalibrationState& state) const {
  return distances_.empty() ? evaluate_terms(state) : evaluate_distances(state);
}

WhitenedPrior Prior::evaluate_distances(const CalibrationState& state) const {
  const auto count = static_cast<Eigen::Index>(distances_.size());
  Eigen::VectorXd difference_mm(count);
  std::vector<Eigen::MatrixXd> rows(blocks_.size(), Eigen::MatrixXd::Zero(count, 3));
  const auto rows_of = [&](std::size_t led) -> Eigen::MatrixXd& {
    const auto block = std::find(blocks_.begin(), blocks_.end(), BlockId{BlockId::Kind::led, led});
    return rows[static_cast<std::size_t>(block - blocks_.begin())];
  };
  for (Eigen::Index i = 0; i < count; ++i) {
    const LedDistance& distance = distances_[static_cast<std::size_t>(i)];
    assert(state.rig.leds[distance.from].mount == state.rig.leds[distance.to].mount);
    const Eigen::Vector3d between = state.rig.leds[distance.to].position_mm - state.rig.leds[distance.from].position_mm;
    difference_mm[i] = between.norm() - distance.length_mm;
    const Eigen::RowVector3d direction = between.stableNormalized().transpose();
    rows_of(distance.to).row(i) = direction;
    rows_of(distance.from).row(i) = -direction;
  }
  WhitenedPrior result{root_ * difference_mm, {}};
  for (const Eigen::MatrixXd& of_led : rows) result.jacobians.emplace_back(root_ * of_led);
  return result;
}

WhitenedPrior Prior::evaluate_terms(const CalibrationState& state) const {
  const auto count = static_cast<Eigen::Index>(terms_.size());
  Eigen::VectorXd difference(count);
  WhitenedPrior result;
  for (const BlockId& block : blocks_) {
    const BlockDifference of_block = difference_of(block, about_, state);
    Eigen::MatrixXd rows = Eigen::MatrixXd::Zero(count, of_block.value.size());
    for (Eigen::Index i = 0; i < count; ++i) {
      const PriorTerm& term = terms_[static_cast<std::size_t>(i)];
      if (term.block != block) continue;
      difference[i] = of_block.value[term.row];
      rows.row(i) = of_block.d_tangent.row(term.row);
    }
    result.jacobians.emplace_back(root_ * rows);
  }
  result.residuals = root_ * difference;
  return result;
}

}  // namespace crumple
