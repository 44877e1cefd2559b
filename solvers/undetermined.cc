#include "solvers/undetermined.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "solvers/decompositions.h"
#include "solvers/parameters.h"

namespace crumple {
namespace {

constexpr double kPriorsHalf = 0.5;
constexpr double kMovesWith = 0.5;  // correlation
constexpr int kSingleDirections = 3;

// A prior against the fit: both over the prior's blocks, side by side.
struct Comparison {
  std::vector<std::string> names;  // of the blocks' rows
  std::vector<int> rows;           // of the prior's terms, among them
  Eigen::MatrixXd covariance;      // of the fit
  Eigen::MatrixXd gain;            // C J'
  Eigen::MatrixXd hat;             // J C J'
};

Comparison compare(const Prior& prior, const JointCovariance& covariance, const CalibrationState& state) {
  Comparison comparison;
  std::map<BlockId, int> offsets;
  for (const BlockId& block : prior.blocks()) {
    offsets[block] = static_cast<int>(comparison.names.size());
    const std::vector<std::string> names = parameter_names(block, state);
    comparison.names.insert(comparison.names.end(), names.begin(), names.end());
  }
  for (const PriorTerm& term : prior.terms()) comparison.rows.push_back(offsets[term.block] + term.row);
  const WhitenedPrior whitened = prior.evaluate(state);
  Eigen::MatrixXd jacobian(whitened.residuals.size(), static_cast<Eigen::Index>(comparison.names.size()));
  int column = 0;
  for (const RowMajorMatrix& block : whitened.jacobians) {
    jacobian.middleCols(column, block.cols()) = block;
    column += static_cast<int>(block.cols());
  }
  comparison.covariance = covariance.of(prior.blocks(), state);
  comparison.gain = comparison.covariance * jacobian.transpose();
  comparison.hat = jacobian * comparison.gain;
  return comparison;
}

Undetermined direction(const Prior& prior, const Comparison& comparison, const Eigen::VectorXd& eigenvector,
                       double share) {
  Undetermined found{prior.name(), share, {}, {}};
  const Eigen::VectorXd with_direction = comparison.gain * eigenvector / std::sqrt(share);
  for (int i = 0; i < with_direction.size(); ++i) {
    const double sigma = std::sqrt(comparison.covariance(i, i));
    if (!(std::abs(with_direction[i]) > kMovesWith * sigma)) continue;
    const bool own = std::find(comparison.rows.begin(), comparison.rows.end(), i) != comparison.rows.end();
    (own ? found.terms : found.partners).push_back(comparison.names[static_cast<std::size_t>(i)]);
  }
  return found;
}

Undetermined each_for_itself(const Prior& prior, const Comparison& comparison, double share) {
  Undetermined found{prior.name(), share, {}, {}};
  for (std::size_t i = 0; i < comparison.rows.size(); ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    if (comparison.hat(row, row) > kPriorsHalf) {
      found.terms.push_back(comparison.names[static_cast<std::size_t>(comparison.rows[i])]);
    }
  }
  return found;
}

}  // namespace

std::vector<Undetermined> undetermined_terms(const std::vector<Prior>& priors, const JointCovariance& covariance,
                                             const CalibrationState& state) {
  std::vector<Undetermined> all;
  for (const Prior& prior : priors) {
    if (!prior.weak()) continue;
    const Comparison comparison = compare(prior, covariance, state);
    const auto& [shares, directions] = symmetric_eigen(comparison.hat);
    const auto last = shares.size() - 1;
    const auto count = (shares.array() > kPriorsHalf).count();
    if (count > kSingleDirections) {
      all.push_back(each_for_itself(prior, comparison, shares[last]));
      continue;
    }
    for (Eigen::Index i = last; i > last - count; --i) {
      all.push_back(direction(prior, comparison, directions.col(i), shares[i]));
    }
  }
  return all;
}

}  // namespace crumple
