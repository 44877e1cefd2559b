#include "calib/view_information.h"

#include <algorithm>
#include <set>

#include "solvers/decompositions.h"
#include "solvers/normal_equations.h"

namespace crumple {
namespace {

constexpr double kUndetermined = 1e-10;  // eigenvalue of an information scaled to a unit diagonal

// A shared lens is its owner's block.
BlockId own_block(const BlockId& block, const CalibrationState& state) {
  if (block.kind != BlockId::Kind::lens) return block;
  return {block.kind, state.rig.sensors[block.index].lens_of.value_or(block.index)};
}

// Where a block's rows are among the parameters; none where no view touches it.
std::optional<Eigen::Index> offset_of(const Parameters& parameters, const BlockId& block) {
  if (const auto offset = parameters.common_offset(block)) return *offset;
  if (const auto slot = parameters.slot(block)) {
    return parameters.common_size() + 6 * static_cast<Eigen::Index>(*slot);
  }
  return std::nullopt;
}

Eigen::MatrixXd dense(const NormalEquations& equations) {
  const Eigen::Index common = equations.common().rows();
  const auto poses = static_cast<Eigen::Index>(equations.eliminated().size());
  Eigen::MatrixXd all = Eigen::MatrixXd::Zero(common + 6 * poses, common + 6 * poses);
  all.topLeftCorner(common, common) = equations.common();
  for (Eigen::Index p = 0; p < poses; ++p) {
    const PoseEquations& pose = equations.eliminated()[static_cast<std::size_t>(p)];
    const Eigen::Index at = common + 6 * p;
    all.block<6, 6>(at, at) = pose.information;
    all.block(0, at, common, 6) = pose.coupling;
    all.block(at, 0, 6, common) = pose.coupling.transpose();
  }
  return all;
}

}  // namespace

std::optional<Eigen::MatrixXd> information(const Observations& observations, const CalibrationState& state,
                                           const WeightOf& weight_of, const std::vector<BlockId>& blocks) {
  const auto views = make_views(observations, state.board_of);
  std::set<BlockId> held;
  for (const auto& view : views) {
    for (const BlockId& block : view->blocks()) {
      const BlockId own = own_block(block, state);
      if (std::find(blocks.begin(), blocks.end(), own) == blocks.end()) held.insert(own);
    }
  }
  const Parameters parameters(state, views, held);
  const auto whitened = [&](std::size_t v, ViewEvaluation& evaluation) {
    if (!views[v]->evaluate(state, true, evaluation)) return false;
    ViewWeights weights = weight_of(*views[v]);
    weights.inlier.assign(static_cast<std::size_t>(views[v]->size()), 1);
    whiten(*views[v], weights, evaluation);
    discount(weights, evaluation);
    return true;
  };
  const auto equations = NormalEquations::of(views, parameters, whitened, 1);
  if (!equations) return std::nullopt;
  const Eigen::MatrixXd all = dense(*equations);

  std::vector<Eigen::Index> to, from;  // rows of the result and of `all`
  Eigen::Index row = 0;
  for (const BlockId& block : blocks) {
    const int size = tangent_size(block, state);
    const auto offset = offset_of(parameters, block);
    for (int i = 0; offset && i < size; ++i) {
      to.push_back(row + i);
      from.push_back(*offset + i);
    }
    row += size;
  }
  Eigen::MatrixXd result = Eigen::MatrixXd::Zero(row, row);
  result(to, to) = all(from, from);
  return result;
}

std::optional<Eigen::MatrixXd> without_last(const Eigen::MatrixXd& information, Eigen::Index rows) {
  const Eigen::Index kept = information.rows() - rows;
  const auto inverse = inverse_information(information.bottomRightCorner(rows, rows), kUndetermined);
  if (!inverse) return std::nullopt;
  const Eigen::MatrixXd coupling = information.topRightCorner(kept, rows);
  return information.topLeftCorner(kept, kept) - coupling * *inverse * coupling.transpose();
}

Eigen::MatrixXd gain_of(const Eigen::MatrixXd& information, const Eigen::MatrixXd& covariance) {
  const Eigen::VectorXd sigmas = covariance.diagonal().cwiseSqrt();
  const SymmetricEigen eigen = symmetric_eigen(sigmas.asDiagonal() * information * sigmas.asDiagonal());
  const Eigen::VectorXd values = eigen.values.cwiseMax(0);
  const Eigen::MatrixXd root = eigen.vectors * values.cwiseSqrt().asDiagonal();
  // In units of the sigmas; divided by them at the end, so rows of blocks that are known exactly must not occur.
  const Eigen::VectorXd weights = sigmas.cwiseInverse();
  const Eigen::MatrixXd scaled = weights.asDiagonal() * root;
  Eigen::MatrixXd inner = scaled.transpose() * covariance * scaled;
  inner.diagonal().array() += 1;
  return scaled * inverse_positive(inner) * scaled.transpose();
}

}  // namespace crumple
