#include "solvers/normal_equations.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Cholesky>

#include "solvers/decompositions.h"
#include "solvers/parallel.h"
#include "solvers/view_partition.h"

namespace crumple {
namespace {

constexpr std::size_t kPanelPoses = 16;  // eliminated together

// 1 / sqrt of the diagonal, and 1 where no observation says anything.
template <typename Matrix>
Eigen::VectorXd equilibrating_scale(const Matrix& matrix) {
  return matrix.diagonal().unaryExpr([](double d) { return d > 0 ? 1 / std::sqrt(d) : 1.0; });
}

template <typename Matrix>
void damp(double damping, Matrix& equilibrated) {
  for (Eigen::Index i = 0; i < equilibrated.rows(); ++i) {
    double& d = equilibrated(i, i);
    d = d > 0 ? 1 + damping : 1;
  }
}

using Coupling = Eigen::Matrix<double, Eigen::Dynamic, 6>;

// A pose taken out of the equilibrated, damped equations: D = L L'.
struct Eliminated {
  bool definite = false;
  Vector6d scale;
  Matrix6d root;              // L
  Vector6d reduced_gradient;  // L^-1 g
};

Eliminated eliminate(const PoseEquations& pose, double damping) {
  Eliminated e;
  e.scale = equilibrating_scale(pose.information);
  Matrix6d information = e.scale.asDiagonal() * pose.information * e.scale.asDiagonal();
  damp(damping, information);
  const Eigen::LLT<Matrix6d> llt(information);
  e.definite = llt.info() == Eigen::Success;
  if (!e.definite) return e;
  e.root = llt.matrixL();
  e.reduced_gradient = llt.matrixL().solve(e.scale.cwiseProduct(pose.gradient));
  return e;
}

// B L^-T, B equilibrated.
Coupling reduced_coupling(const PoseEquations& pose, const Eliminated& e, const Eigen::VectorXd& scale) {
  const Coupling coupling = scale.asDiagonal() * pose.coupling * e.scale.asDiagonal();
  return e.root.transpose().triangularView<Eigen::Upper>().solve<Eigen::OnTheRight>(coupling);
}

// What some poses, eliminated, take from the common equations.
struct Reduction {
  Eigen::MatrixXd information;  // lower triangle
  Eigen::VectorXd gradient;
  bool definite = true;
};

Reduction reduce(const std::vector<PoseEquations>& poses, std::size_t begin, std::size_t end,
                 const Eigen::VectorXd& scale, double damping, std::vector<Eliminated>& eliminated) {
  const Eigen::Index n = scale.size();
  Reduction reduction{Eigen::MatrixXd::Zero(n, n), Eigen::VectorXd::Zero(n)};
  Eigen::MatrixXd panel(n, 6 * static_cast<Eigen::Index>(kPanelPoses));
  for (std::size_t first = begin; first < end; first += kPanelPoses) {
    const std::size_t count = std::min(kPanelPoses, end - first);
    for (std::size_t k = 0; k < count; ++k) {
      const PoseEquations& pose = poses[first + k];
      Eliminated& e = eliminated[first + k] = eliminate(pose, damping);
      if (!e.definite) {
        reduction.definite = false;
        return reduction;
      }
      auto columns = panel.middleCols<6>(6 * static_cast<Eigen::Index>(k));
      columns = reduced_coupling(pose, e, scale);
      reduction.gradient.noalias() += columns * e.reduced_gradient;
    }
    const auto filled = panel.leftCols(6 * static_cast<Eigen::Index>(count));
    reduction.information.selfadjointView<Eigen::Lower>().rankUpdate(filled);
  }
  return reduction;
}

}  // namespace

NormalEquations::NormalEquations(const Parameters& parameters)
    : parameters_(&parameters), poses_(parameters.eliminated().size()) {
  sums_.information.setZero(parameters.common_size(), parameters.common_size());
  sums_.gradient.setZero(parameters.common_size());
  for (PoseEquations& pose : poses_) pose.coupling.setZero(parameters.common_size(), 6);
}

void NormalEquations::add(const View& view, const ViewEvaluation& whitened) { add(view, whitened, sums_); }

void NormalEquations::add(const View& view, const ViewEvaluation& whitened, CommonSums& sums) {
  const RowMajorMatrix& jacobian = whitened.jacobian;
  Eigen::MatrixXd local = Eigen::MatrixXd::Zero(jacobian.cols(), jacobian.cols());
  local.selfadjointView<Eigen::Lower>().rankUpdate(jacobian.transpose());
  const Eigen::MatrixXd& from_blocks = whitened.local_from_blocks;
  const Eigen::MatrixXd half = local.selfadjointView<Eigen::Lower>() * from_blocks;
  const Eigen::MatrixXd information = from_blocks.transpose() * half;
  const Eigen::VectorXd gradient = from_blocks.transpose() * (jacobian.transpose() * whitened.residuals);
  sums.cost += 0.5 * whitened.residuals.squaredNorm();

  scatter(view.blocks(), information, gradient, sums);
}

void NormalEquations::add(const Prior& prior, const CalibrationState& state) {
  if (parameters_->spans(prior.blocks()).empty()) return;
  const WhitenedPrior whitened = prior.evaluate(state);
  Eigen::Index columns = 0;
  for (const RowMajorMatrix& block : whitened.jacobians) columns += block.cols();
  Eigen::MatrixXd jacobian(whitened.residuals.size(), columns);
  columns = 0;
  for (const RowMajorMatrix& block : whitened.jacobians) {
    jacobian.middleCols(columns, block.cols()) = block;
    columns += block.cols();
  }
  sums_.cost += 0.5 * whitened.residuals.squaredNorm();
  scatter(prior.blocks(), jacobian.transpose() * jacobian, jacobian.transpose() * whitened.residuals, sums_);
}

void NormalEquations::scatter(const std::vector<BlockId>& blocks, const Eigen::MatrixXd& information,
                              const Eigen::VectorXd& gradient, CommonSums& sums) {
  const std::vector<Parameters::Span> spans = parameters_->spans(blocks);
  for (const Parameters::Span& row : spans) {
    if (row.slot) {
      PoseEquations& pose = poses_[*row.slot];
      pose.information += information.block<6, 6>(row.column, row.column);
      pose.gradient += gradient.segment<6>(row.column);
      continue;
    }
    sums.gradient.segment(row.common_offset, row.size) += gradient.segment(row.column, row.size);
    for (const Parameters::Span& column : spans) {
      const auto block = information.block(row.column, column.column, row.size, column.size);
      if (column.slot) {
        poses_[*column.slot].coupling.middleRows(row.common_offset, row.size) += block;
      } else {
        sums.information.block(row.common_offset, column.common_offset, row.size, column.size) += block;
      }
    }
  }
}

std::optional<NormalEquations> NormalEquations::of(const std::vector<std::unique_ptr<View>>& views,
                                                   const Parameters& parameters, const Evaluate& evaluate,
                                                   int threads) {
  NormalEquations equations(parameters);
  const ViewPartition parts = partition(views, parameters, part_count(parameters.common_size()));
  std::vector<CommonSums> sums(parts.parts(), equations.sums_);
  std::vector<char> predicted(sums.size(), 1);
  parallel_for(sums.size(), threads, [&](std::size_t part) {
    ViewEvaluation evaluation;
    for (std::size_t i = parts.begins[part]; i < parts.begins[part + 1]; ++i) {
      const std::size_t v = parts.order[i];
      if (!evaluate(v, evaluation)) {
        predicted[part] = 0;
        return;
      }
      equations.add(*views[v], evaluation, sums[part]);
    }
  });
  if (std::count(predicted.begin(), predicted.end(), 0) > 0) return std::nullopt;
  for (const CommonSums& part : sums) {
    equations.sums_.information += part.information;
    equations.sums_.gradient += part.gradient;
    equations.sums_.cost += part.cost;
  }
  return equations;
}

std::optional<DampedStep> NormalEquations::solve(double damping, int threads) const {
  const int n = parameters_->common_size();
  const Eigen::VectorXd scale = equilibrating_scale(sums_.information);
  std::vector<Eliminated> eliminated(poses_.size());
  const std::size_t share = poses_.size() / part_count(n) + 1;
  std::vector<Reduction> parts((poses_.size() + share - 1) / share);
  parallel_for(parts.size(), threads, [&](std::size_t part) {
    parts[part] = reduce(poses_, part * share, std::min((part + 1) * share, poses_.size()), scale, damping, eliminated);
  });

  Eigen::MatrixXd schur = scale.asDiagonal() * sums_.information * scale.asDiagonal();
  damp(damping, schur);
  const Eigen::VectorXd gradient = scale.cwiseProduct(sums_.gradient);
  Eigen::VectorXd right = -gradient;
  for (const Reduction& part : parts) {
    if (!part.definite) return std::nullopt;
    schur -= part.information;
    right += part.gradient;
  }
  const auto solution = solve_positive(schur, right);
  if (!solution) return std::nullopt;
  const Eigen::VectorXd& common = *solution;

  DampedStep step{Eigen::VectorXd(parameters_->size())};
  step.tangent.head(n) = scale.cwiseProduct(common);
  double decrease = damping * common.squaredNorm() - gradient.dot(common);
  std::vector<double> decreases(parts.size(), 0);
  parallel_for(parts.size(), threads, [&](std::size_t part) {
    for (std::size_t p = part * share; p < std::min((part + 1) * share, poses_.size()); ++p) {
      const Eliminated& e = eliminated[p];
      const Coupling coupling = reduced_coupling(poses_[p], e, scale);
      const Vector6d reduced = -e.reduced_gradient - coupling.transpose() * common;
      const Vector6d own = e.root.transpose().triangularView<Eigen::Upper>().solve(reduced);
      step.tangent.segment<6>(n + 6 * static_cast<Eigen::Index>(p)) = e.scale.cwiseProduct(own);
      decreases[part] += damping * own.squaredNorm() - e.scale.cwiseProduct(poses_[p].gradient).dot(own);
    }
  });
  for (const double of_part : decreases) decrease += of_part;
  step.predicted_decrease = 0.5 * decrease;
  return step;
}

}  // namespace crumple
