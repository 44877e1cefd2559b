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
  auto root = inverse_cholesky_factor(covariance);
  if (!root || !covariance.allFinite()) {
    return fail(fmt::format("{}: its covariance is not positive definite", name));
  }
  return Prior(std::move(name), std::move(terms), std::move(about), *std::move(root));
}

Prior Prior::as_weak() const {
  Prior prior = *this;
  prior.weak_ = true;
  return prior;
}

Eigen::VectorXd Prior::sigmas() const { return inverse_lower(root_).rowwise().norm(); }

WhitenedPrior Prior::evaluate(const CalibrationState& state) const {
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
