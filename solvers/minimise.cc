#include "solvers/minimise.h"

#include <map>
#include <utility>

#include <ceres/ceres.h>
#include <fmt/format.h>

#include "solvers/parallel.h"
#include "solvers/parameters.h"

namespace crumple {
namespace {

constexpr int kPoseSize = 7;  // qx qy qz qw tx ty tz

// Poses move by crumple's tangent. Residual blocks give Ceres their Jacobian in the tangent already, padded with a zero
// column; [I6; 0] as the derivative of Plus takes the padding off again.
class PoseManifold final : public ceres::Manifold {
 public:
  int AmbientSize() const override { return kPoseSize; }
  int TangentSize() const override { return 6; }
  bool Plus(const double* x, const double* delta, double* x_plus_delta) const override {
    const Pose moved = retract(unpack(x), Eigen::Map<const Vector6d>(delta));
    pack(moved, x_plus_delta);
    return true;
  }
  bool PlusJacobian(const double*, double* jacobian) const override {
    Eigen::Map<Eigen::Matrix<double, kPoseSize, 6, Eigen::RowMajor>>(jacobian).setIdentity();
    return true;
  }
  bool Minus(const double* y, const double* x, double* y_minus_x) const override {
    Eigen::Map<Vector6d>(y_minus_x, 6) = local_step(unpack(x), unpack(y));
    return true;
  }
  bool MinusJacobian(const double*, double* jacobian) const override {
    Eigen::Map<Eigen::Matrix<double, 6, kPoseSize, Eigen::RowMajor>>(jacobian).setIdentity();
    return true;
  }

  static Pose unpack(const double* x) {
    return {Eigen::Quaterniond(Eigen::Map<const Eigen::Vector4d>(x)), Eigen::Map<const Eigen::Vector3d>(x + 4)};
  }
  static void pack(const Pose& pose, double* x) {
    Eigen::Map<Eigen::Vector4d>(x, 4) = pose.rotation.coeffs();
    Eigen::Map<Eigen::Vector3d>(x + 4, 3) = pose.translation;
  }
};

// The state as Ceres's parameter blocks, in one array: Ceres orders the blocks of an elimination group by address, so
// separate allocations would make the order of its sums, and with it the last bits, a matter of luck.
class Blocks {
 public:
  Blocks(const CalibrationState& state, const Parameters& parameters) {
    std::vector<BlockId> blocks = parameters.common_blocks();
    for (const std::size_t p : parameters.placements()) blocks.push_back({BlockId::Kind::placement, p});
    for (const BlockId& block : blocks) {
      const std::vector<double> value = read(state, block);
      spans_[block] = {values_.size(), value.size()};
      values_.insert(values_.end(), value.begin(), value.end());
    }
  }

  const std::map<BlockId, std::pair<std::size_t, std::size_t>>& spans() const { return spans_; }
  double* data(const BlockId& block) { return values_.data() + spans_.at(block).first; }

  void write_to(CalibrationState& state) const {
    for (const auto& [block, span] : spans_) {
      const double* value = values_.data() + span.first;
      switch (block.kind) {
        case BlockId::Kind::lens: {
          Lens& lens = state.rig.sensors[block.index].lens;
          lens = lens.with_parameters({value, value + span.second});
          break;
        }
        case BlockId::Kind::mount:
          state.rig.sensors[block.index].sensor_from_probe = PoseManifold::unpack(value);
          break;
        case BlockId::Kind::warp:
          state.boards[block.index].warp_mm = Eigen::Map<const Eigen::Vector2d>(value);
          break;
        case BlockId::Kind::scale:
          state.boards[block.index].scale = *value;
          break;
        case BlockId::Kind::placement:
          state.probe_from_board[block.index] = PoseManifold::unpack(value);
          break;
      }
    }
  }

 private:
  static std::vector<double> read(const CalibrationState& state, const BlockId& block) {
    if (block.kind == BlockId::Kind::lens) return state.rig.sensors[block.index].lens.parameters();
    if (block.kind == BlockId::Kind::warp) {
      const Eigen::Vector2d& warp = state.boards[block.index].warp_mm;
      return {warp.x(), warp.y()};
    }
    if (block.kind == BlockId::Kind::scale) return {state.boards[block.index].scale};
    std::vector<double> value(kPoseSize);
    PoseManifold::pack(block.kind == BlockId::Kind::mount ? state.rig.sensors[block.index].sensor_from_probe
                                                          : state.probe_from_board[block.index],
                       value.data());
    return value;
  }

  std::vector<double> values_;
  std::map<BlockId, std::pair<std::size_t, std::size_t>> spans_;  // offset and size in values_
};

// Evaluates every view at Ceres's current point, in parallel, before Ceres asks for any of them.
class Evaluator final : public ceres::EvaluationCallback {
 public:
  Evaluator(const std::vector<std::unique_ptr<View>>& views, const std::vector<ViewWeights>& weights,
            const MinimiseOptions& options, const Blocks& blocks, CalibrationState state)
      : views_(views), weights_(weights), options_(options), blocks_(blocks), state_(std::move(state)) {
    evaluations_.resize(views.size());
    predicted_.resize(views.size());
  }

  void PrepareForEvaluation(bool evaluate_jacobians, bool) override {
    blocks_.write_to(state_);
    parallel_for(views_.size(), options_.threads, [&](std::size_t v) {
      predicted_[v] = views_[v]->evaluate(state_, evaluate_jacobians, evaluations_[v]);
      if (!predicted_[v]) return;
      whiten(*views_[v], weights_[v], evaluations_[v]);
      if (options_.cauchy_scale) robustify(*views_[v], *options_.cauchy_scale, evaluations_[v]);
      discount(weights_[v], evaluations_[v]);
    });
    priors_.clear();
    for (const Prior& prior : options_.priors) priors_.push_back(prior.evaluate(state_));
  }

  // Null where the view could not be predicted.
  const ViewEvaluation* of(std::size_t view) const { return predicted_[view] ? &evaluations_[view] : nullptr; }
  const WhitenedPrior& prior(std::size_t index) const { return priors_[index]; }

 private:
  const std::vector<std::unique_ptr<View>>& views_;
  const std::vector<ViewWeights>& weights_;
  const MinimiseOptions& options_;
  const Blocks& blocks_;
  CalibrationState state_;
  std::vector<ViewEvaluation> evaluations_;
  std::vector<char> predicted_;
  std::vector<WhitenedPrior> priors_;
};

// Residual blocks give their Jacobian in the tangent; Ceres wants it padded to the ambient size.
void pad(const RowMajorMatrix& tangent, int ambient_size, double* jacobian) {
  Eigen::Map<RowMajorMatrix> ambient(jacobian, tangent.rows(), ambient_size);
  ambient.setZero();
  ambient.leftCols(tangent.cols()) = tangent;
}

// Hands one view's rows to Ceres. `columns` are the view's blocks that are estimated.
class ViewCost final : public ceres::CostFunction {
 public:
  ViewCost(const Evaluator& evaluator, std::size_t view, int rows, std::vector<std::size_t> columns,
           const std::vector<int>& block_sizes)
      : evaluator_(evaluator), view_(view), columns_(std::move(columns)) {
    set_num_residuals(rows);
    *mutable_parameter_block_sizes() = block_sizes;
  }

  bool Evaluate(const double* const*, double* residuals, double** jacobians) const override {
    const ViewEvaluation* evaluation = evaluator_.of(view_);
    if (evaluation == nullptr || !evaluation->residuals.allFinite()) return false;
    Eigen::Map<Eigen::VectorXd>(residuals, num_residuals()) = evaluation->residuals;
    for (std::size_t k = 0; jacobians != nullptr && k < columns_.size(); ++k) {
      if (jacobians[k] != nullptr) pad(evaluation->jacobians[columns_[k]], parameter_block_sizes()[k], jacobians[k]);
    }
    return true;
  }

 private:
  const Evaluator& evaluator_;
  std::size_t view_;
  std::vector<std::size_t> columns_;
};

class PriorCost final : public ceres::CostFunction {
 public:
  PriorCost(const Evaluator& evaluator, std::size_t prior, int rows, std::vector<std::size_t> columns,
            const std::vector<int>& block_sizes)
      : evaluator_(evaluator), prior_(prior), columns_(std::move(columns)) {
    set_num_residuals(rows);
    *mutable_parameter_block_sizes() = block_sizes;
  }

  bool Evaluate(const double* const*, double* residuals, double** jacobians) const override {
    const WhitenedPrior& whitened = evaluator_.prior(prior_);
    Eigen::Map<Eigen::VectorXd>(residuals, num_residuals()) = whitened.residuals;
    for (std::size_t k = 0; jacobians != nullptr && k < columns_.size(); ++k) {
      if (jacobians[k] != nullptr) pad(whitened.jacobians[columns_[k]], parameter_block_sizes()[k], jacobians[k]);
    }
    return true;
  }

 private:
  const Evaluator& evaluator_;
  std::size_t prior_;
  std::vector<std::size_t> columns_;
};

// The blocks among those given that are estimated: where they stand, how large they are, where their values are.
struct Columns {
  std::vector<std::size_t> indices;
  std::vector<int> sizes;
  std::vector<double*> pointers;

  Columns(const std::vector<BlockId>& wanted, Blocks& blocks) {
    for (std::size_t b = 0; b < wanted.size(); ++b) {
      const auto span = blocks.spans().find(wanted[b]);
      if (span == blocks.spans().end()) continue;
      indices.push_back(b);
      sizes.push_back(static_cast<int>(span->second.second));
      pointers.push_back(blocks.data(span->first));
    }
  }
};

void add_priors(const std::vector<Prior>& priors, const Evaluator& evaluator, Blocks& blocks, ceres::Problem& problem) {
  for (std::size_t p = 0; p < priors.size(); ++p) {
    const Columns columns(priors[p].blocks(), blocks);
    if (columns.pointers.empty()) continue;
    const int rows = static_cast<int>(priors[p].terms().size());
    problem.AddResidualBlock(new PriorCost(evaluator, p, rows, columns.indices, columns.sizes), nullptr,
                             columns.pointers);
  }
}

void add_views(const std::vector<std::unique_ptr<View>>& views, const Evaluator& evaluator, Blocks& blocks,
               ceres::Problem& problem) {
  for (std::size_t v = 0; v < views.size(); ++v) {
    const Columns columns(views[v]->blocks(), blocks);
    if (columns.pointers.empty()) continue;
    const int rows = views[v]->size() * views[v]->dimension();
    problem.AddResidualBlock(new ViewCost(evaluator, v, rows, columns.indices, columns.sizes), nullptr,
                             columns.pointers);
  }
}

ceres::Solver::Options solver_options(Blocks& blocks, int max_iterations) {
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::DENSE_SCHUR;
  options.linear_solver_ordering = std::make_shared<ceres::ParameterBlockOrdering>();
  for (const auto& [block, span] : blocks.spans()) {
    const int group = block.kind == BlockId::Kind::placement ? 0 : 1;
    options.linear_solver_ordering->AddElementToGroup(blocks.data(block), group);
  }
  options.num_threads = 1;
  options.max_num_iterations = max_iterations;
  options.function_tolerance = 1e-14;
  options.gradient_tolerance = 1e-14;
  options.parameter_tolerance = 1e-14;
  options.jacobi_scaling = true;
  options.logging_type = ceres::SILENT;
  return options;
}

}  // namespace

Expected<MinimiseSummary> minimise(const std::vector<std::unique_ptr<View>>& views,
                                   const std::vector<ViewWeights>& weights, const MinimiseOptions& options,
                                   CalibrationState& state) {
  const Parameters parameters(state, views, options.held);
  Blocks blocks(state, parameters);
  Evaluator evaluator(views, weights, options, blocks, state);
  ceres::Problem::Options problem_options;
  problem_options.evaluation_callback = &evaluator;
  ceres::Problem problem(problem_options);
  add_views(views, evaluator, blocks, problem);
  add_priors(options.priors, evaluator, blocks, problem);
  for (const auto& [block, span] : blocks.spans()) {
    const bool pose = block.kind == BlockId::Kind::mount || block.kind == BlockId::Kind::placement;
    if (pose) problem.SetManifold(blocks.data(block), new PoseManifold);
  }

  ceres::Solver::Summary summary;
  ceres::Solve(solver_options(blocks, options.max_iterations), &problem, &summary);
  if (summary.termination_type == ceres::FAILURE) {
    return fail(
        fmt::format("the joint refinement failed ({}): the start is too far from the observations", summary.message));
  }
  blocks.write_to(state);
  return MinimiseSummary{static_cast<int>(summary.iterations.size()), summary.termination_type == ceres::CONVERGENCE,
                         summary.initial_cost, summary.final_cost};
}

}  // namespace crumple
