#include "solvers/covariance.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numeric>

#include <Eigen/Cholesky>
#include <fmt/format.h>

#include "solvers/decompositions.h"

namespace crumple {
namespace {

constexpr double kSingular = 1e-12;  // rounding reaches 1e-15
constexpr int kNamedComponents = 4;

// The parameters that move most along an eigenvector of the equilibrated matrix.
std::string in_words(const Eigen::VectorXd& direction, const std::vector<std::string>& names) {
  std::vector<int> order(names.size());
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(),
                   [&](int i, int j) { return std::abs(direction[i]) > std::abs(direction[j]); });
  std::string words;
  for (int k = 0; k < std::min<int>(kNamedComponents, static_cast<int>(order.size())); ++k) {
    if (k > 0 && std::abs(direction[order[k]]) < 0.1) break;
    words += fmt::format("{}{}", k == 0 ? "" : ", ", names[static_cast<std::size_t>(order[k])]);
  }
  return words;
}

}  // namespace

NormalEquations::NormalEquations(const Parameters& parameters)
    : parameters_(parameters), common_(Eigen::MatrixXd::Zero(parameters.common_size(), parameters.common_size())) {
  for (const std::size_t p : parameters.placements()) {
    placement_[p].setZero();
    coupling_[p].setZero(parameters.common_size(), 6);
  }
}

void NormalEquations::add(const View& view, const ViewEvaluation& whitened) { add(view.blocks(), whitened.jacobians); }

void NormalEquations::add(const Prior& prior, const CalibrationState& state) {
  add(prior.blocks(), prior.evaluate(state).jacobians);
}

// At most one of the blocks is a placement.
void NormalEquations::add(const std::vector<BlockId>& blocks, const std::vector<RowMajorMatrix>& jacobians) {
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    if (!parameters_.estimated(blocks[i])) continue;
    const RowMajorMatrix& left = jacobians[i];
    const auto row = parameters_.common_offset(blocks[i]);
    if (!row) {
      placement_[blocks[i].index] += left.transpose() * left;
      continue;
    }
    for (std::size_t j = 0; j < blocks.size(); ++j) {
      const RowMajorMatrix& right = jacobians[j];
      if (const auto column = parameters_.common_offset(blocks[j])) {
        common_.block(*row, *column, left.cols(), right.cols()).noalias() += left.transpose() * right;
      } else if (parameters_.estimated(blocks[j])) {
        coupling_[blocks[j].index].middleRows(*row, left.cols()).noalias() += left.transpose() * right;
      }
    }
  }
}

Expected<JointCovariance> JointCovariance::create(const NormalEquations& equations, const CalibrationState& state) {
  JointCovariance result(equations.parameters_);
  Eigen::MatrixXd schur = equations.common_;
  for (const auto& [p, information] : equations.placement_) {
    const Eigen::Vector<double, 6> scale = information.diagonal().cwiseSqrt().cwiseInverse();
    const Matrix6d equilibrated = scale.asDiagonal() * information * scale.asDiagonal();
    const SymmetricEigen eigen = symmetric_eigen(equilibrated);
    if (!scale.allFinite() || eigen.values[0] < kSingular) {
      return fail(fmt::format("the pose of board placement {} is not determined by its observations", p));
    }
    const Matrix6d inverse = scale.asDiagonal() *
                             (eigen.vectors * eigen.values.cwiseInverse().asDiagonal() * eigen.vectors.transpose()) *
                             scale.asDiagonal();
    const auto& coupling = equations.coupling_.at(p);
    result.placement_inverse_[p] = inverse;
    result.gain_[p] = coupling * inverse;
    schur.noalias() -= result.gain_[p] * coupling.transpose();
  }
  result.names_ = equations.parameters_.common_names(state);
  const std::vector<std::string>& names = result.names_;
  const Eigen::VectorXd diagonal = schur.diagonal();
  for (int i = 0; i < diagonal.size(); ++i) {
    if (!(diagonal[i] > kSingular * equations.common_(i, i))) {
      return fail(fmt::format("{} is not determined by the observations", names[static_cast<std::size_t>(i)]));
    }
  }
  const Eigen::VectorXd scale = diagonal.cwiseSqrt().cwiseInverse();
  const Eigen::MatrixXd equilibrated = scale.asDiagonal() * schur * scale.asDiagonal();
  const SymmetricEigen eigen = symmetric_eigen(equilibrated);
  result.weakest_direction_ = in_words(eigen.vectors.col(0), names);
  if (!(eigen.values[0] > kSingular)) {
    return fail(
        fmt::format("the observations do not determine the parameters: {} can move together without changing "
                    "any residual; add views that tell them apart or choose a lens model with fewer terms",
                    result.weakest_direction_));
  }
  result.condition_ = eigen.values.tail<1>()[0] / eigen.values[0];
  const Eigen::MatrixXd inverse = equilibrated.llt().solve(Eigen::MatrixXd::Identity(schur.rows(), schur.cols()));
  result.common_ = scale.asDiagonal() * (0.5 * (inverse + inverse.transpose())) * scale.asDiagonal();
  return result;
}

Eigen::MatrixXd JointCovariance::of(const std::vector<BlockId>& blocks, const CalibrationState& state) const {
  // Rows of the blocks as a linear map of (a, e): block = T a + e, where e is a placement's own part.
  int size = 0;
  for (const BlockId& block : blocks) size += tangent_size(block, state);
  Eigen::MatrixXd from_common = Eigen::MatrixXd::Zero(size, common_.rows());
  Eigen::MatrixXd own = Eigen::MatrixXd::Zero(size, size);
  int row = 0;
  int placements = 0;
  for (const BlockId& block : blocks) {
    const int rows = tangent_size(block, state);
    if (const auto offset = parameters_.common_offset(block)) {
      from_common.block(row, *offset, rows, rows).setIdentity();
    } else if (parameters_.estimated(block)) {
      ++placements;
      from_common.middleRows(row, rows) = -gain_.at(block.index).transpose();
      own.block(row, row, rows, rows) = placement_inverse_.at(block.index);
    }
    row += rows;
  }
  assert(placements <= 1);
  return from_common * common_ * from_common.transpose() + own;
}

}  // namespace crumple
