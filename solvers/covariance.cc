#include "solvers/covariance.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numeric>

#include <Eigen/Cholesky>
#include <fmt/format.h>

#include "solvers/decompositions.h"
#include "solvers/rig_covariance.h"
#include "solvers/square_root.h"

namespace crumple {
namespace {

constexpr double kSingular = 1e-12;  // rounding reaches 1e-15
constexpr double kSingularRoot = 1e-10;
constexpr double kSquaresLoseDigits = 1e6;
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

Expected<JointCovariance> JointCovariance::create(const NormalEquations& equations, const CalibrationState& state,
                                                  const std::function<Eigen::MatrixXd()>& square_root) {
  const Parameters& parameters = equations.parameters();
  JointCovariance result(parameters);
  Eigen::MatrixXd schur = equations.common();
  for (std::size_t p = 0; p < equations.eliminated().size(); ++p) {
    const Matrix6d& information = equations.eliminated()[p].information;
    const Eigen::Vector<double, 6> scale = information.diagonal().cwiseSqrt().cwiseInverse();
    const Matrix6d equilibrated = scale.asDiagonal() * information * scale.asDiagonal();
    const Eigen::LLT<Matrix6d> llt(equilibrated);
    const Matrix6d equilibrated_inverse = llt.solve(Matrix6d::Identity());
    // One over the trace is the least eigenvalue within a factor of six.
    const double least = 1 / equilibrated_inverse.trace();
    if (!scale.allFinite() || llt.info() != Eigen::Success || !(least > kSingular)) {
      const BlockId& pose = parameters.eliminated()[p];
      return fail(fmt::format("the pose of {} {} is not determined by its observations",
                              pose.kind == BlockId::Kind::station ? "station" : "board placement", pose.index));
    }
    const Matrix6d inverse = scale.asDiagonal() * equilibrated_inverse * scale.asDiagonal();
    const auto& coupling = equations.eliminated()[p].coupling;
    result.pose_inverse_.push_back(inverse);
    result.gain_.push_back(coupling * inverse);
    schur.noalias() -= result.gain_.back() * coupling.transpose();
  }
  result.names_ = parameters.common_names(state);
  const std::vector<std::string>& names = result.names_;
  if (names.empty()) return result;  // poses only, each by itself
  const Eigen::VectorXd diagonal = schur.diagonal();
  for (int i = 0; i < diagonal.size(); ++i) {
    if (!(diagonal[i] > kSingular * equations.common()(i, i))) {
      if (square_root && result.take(square_root())) return result;
      return fail(fmt::format("{} is not determined by the observations", names[static_cast<std::size_t>(i)]));
    }
  }
  const Eigen::VectorXd scale = diagonal.cwiseSqrt().cwiseInverse();
  const Eigen::MatrixXd equilibrated = scale.asDiagonal() * schur * scale.asDiagonal();
  const auto inverse_root = inverse_cholesky_factor(equilibrated);
  if (inverse_root) {
    result.common_.noalias() = inverse_root->transpose() * *inverse_root;
    const DominantEigen weakest = dominant_eigen(result.common_);
    // No eigenvalue lies below one over the trace of the inverse.
    if (1 / result.common_.trace() > kSingular) {
      result.weakest_direction_ = in_words(weakest.vector, names);
      result.condition_ = dominant_eigen(equilibrated).value * weakest.value;
      result.common_ = scale.asDiagonal() * result.common_ * scale.asDiagonal();
      return result;
    }
  }
  if (square_root && result.take(square_root())) return result;
  result.weakest_direction_ = in_words(symmetric_eigen(equilibrated).vectors.col(0), names);
  return fail(
      fmt::format("the observations do not determine the parameters: {} can move together without changing "
                  "any residual; add views that tell them apart or choose a lens model with fewer terms",
                  result.weakest_direction_));
}

int JointCovariance::rig_rows() const {
  const std::vector<BlockId>& blocks = parameters_.common_blocks();
  const auto poses = std::count_if(blocks.begin(), blocks.end(), [](const BlockId& block) { return block.is_pose(); });
  return parameters_.common_size() - 6 * static_cast<int>(poses);
}

void JointCovariance::sharpen(const std::vector<std::unique_ptr<View>>& views,
                              const NormalEquations::Evaluate& evaluate, const std::vector<Prior>& priors,
                              const CalibrationState& state, int threads) {
  if (condition_ < kSquaresLoseDigits) return;
  take(reduced_square_root(views, parameters_, evaluate, priors, state, threads));
}

bool JointCovariance::take(const Eigen::MatrixXd& square_root) {
  if (square_root.rows() < square_root.cols()) return false;
  const Eigen::VectorXd scale = square_root.colwise().norm().transpose().cwiseInverse();
  const Eigen::MatrixXd equilibrated = square_root * scale.asDiagonal();
  // The least singular value is not above the least of the diagonal, the largest not below a column's norm.
  if (!(equilibrated.diagonal().cwiseAbs().minCoeff() > kSingularRoot)) return false;
  const Eigen::MatrixXd inverse = inverse_upper(equilibrated);
  const Eigen::MatrixXd covariance = inverse * inverse.transpose();
  const double largest = dominant_eigen(equilibrated.transpose() * equilibrated).value;
  if (!(largest * covariance.trace() < 1 / (kSingularRoot * kSingularRoot))) return false;
  const DominantEigen weakest = dominant_eigen(covariance);
  condition_ = largest * weakest.value;
  weakest_direction_ = in_words(weakest.vector, names_);
  common_ = scale.asDiagonal() * covariance * scale.asDiagonal();
  return true;
}

void JointCovariance::widen(const Eigen::MatrixXd& by) {
  assert(widening_.size() == 0 && by.rows() == common_.rows() && by.cols() == common_.cols());
  common_ += by;
  widening_ = by;
}

Eigen::MatrixXd JointCovariance::of(const std::vector<BlockId>& blocks, const CalibrationState& state) const {
  return joint(blocks, state, common_);
}

Eigen::MatrixXd JointCovariance::before_widening(const std::vector<BlockId>& blocks,
                                                 const CalibrationState& state) const {
  return widening_.size() > 0 ? joint(blocks, state, common_ - widening_) : joint(blocks, state, common_);
}

Eigen::MatrixXd JointCovariance::joint(const std::vector<BlockId>& blocks, const CalibrationState& state,
                                       const Eigen::MatrixXd& common) const {
  // Rows of the blocks as a linear map of the common parameters, and each eliminated pose's own part beside it.
  int size = 0;
  for (const BlockId& block : blocks) size += tangent_size(block, state);
  Eigen::MatrixXd cross = Eigen::MatrixXd::Zero(size, common.cols());  // with the common parameters
  int row = 0;
  for (const BlockId& block : blocks) {
    const int rows = tangent_size(block, state);
    if (const auto offset = parameters_.common_offset(block)) {
      cross.middleRows(row, rows) = common.middleRows(*offset, rows);
    } else if (const auto slot = parameters_.slot(block)) {
      cross.middleRows(row, rows).noalias() = -gain_[*slot].transpose() * common;
    }
    row += rows;
  }
  Eigen::MatrixXd joint = Eigen::MatrixXd::Zero(size, size);
  int column = 0;
  for (const BlockId& block : blocks) {
    const int columns = tangent_size(block, state);
    if (const auto offset = parameters_.common_offset(block)) {
      joint.middleCols(column, columns) = cross.middleCols(*offset, columns);
    } else if (const auto slot = parameters_.slot(block)) {
      joint.middleCols(column, columns).noalias() = -cross * gain_[*slot];
      joint.block<6, 6>(column, column) += pose_inverse_[*slot];
    }
    column += columns;
  }
  return joint;
}

RigCovariance JointCovariance::of_rig_and(const TangentFunction& function) const {
  const Eigen::Index rig = rig_rows(), rows = static_cast<Eigen::Index>(function.names.size());
  // An eliminated pose is a linear map of the common parameters and a part of its own beside it.
  Eigen::MatrixXd by_common = Eigen::MatrixXd::Zero(rows, common_.cols());
  Eigen::MatrixXd own = Eigen::MatrixXd::Zero(rows, rows);
  for (const auto& [block, part] : function.by_block) {
    if (const auto offset = parameters_.common_offset(block)) {
      by_common.middleCols(*offset, part.cols()) += part;
    } else if (const auto slot = parameters_.slot(block)) {
      by_common.noalias() -= part.lazyProduct(gain_[*slot].transpose());
      own.noalias() += (part * pose_inverse_[*slot]).lazyProduct(part.transpose());
    }
  }
  const Eigen::MatrixXd with_common = by_common * common_;
  const Eigen::MatrixXd corner = with_common * by_common.transpose() + own;
  RigCovariance joint{{names_.begin(), names_.begin() + rig}, Eigen::MatrixXd(rig + rows, rig + rows)};
  joint.names.insert(joint.names.end(), function.names.begin(), function.names.end());
  joint.matrix.topLeftCorner(rig, rig) = common_.topLeftCorner(rig, rig);
  joint.matrix.bottomLeftCorner(rows, rig) = with_common.leftCols(rig);
  joint.matrix.topRightCorner(rig, rows) = joint.matrix.bottomLeftCorner(rows, rig).transpose();
  joint.matrix.bottomRightCorner(rows, rows) = 0.5 * (corner + corner.transpose());
  std::vector<std::string> estimated;
  for (Eigen::Index i = 0; i < rig + rows; ++i) {
    if (joint.matrix(i, i) > 0) estimated.push_back(joint.names[static_cast<std::size_t>(i)]);
  }
  return {estimated, covariance_of(joint, estimated)};
}

}  // namespace crumple
