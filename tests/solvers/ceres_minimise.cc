#include "tests/solvers/ceres_minimise.h"

#include <functional>
#include <map>
#include <utility>

#include <ceres/ceres.h>

#include "solvers/parallel.h"

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
    for (const BlockId& pose : parameters.eliminated()) blocks.push_back(pose);
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
        case BlockId::Kind::warp:
          state.boards[block.index].warp_mm = Eigen::Map<const Eigen::Vector2d>(value);
          break;
        case BlockId::Kind::scale:
          state.boards[block.index].scale = *value;
          break;
        case BlockId::Kind::led:
          state.rig.leds[block.index].position_mm = Eigen::Map<const Eigen::Vector3d>(value);
          break;
        case BlockId::Kind::mount:
        case BlockId::Kind::placement:
        case BlockId::Kind::station:
          pose_at(state, block) = PoseManifold::unpack(value);
          break;
      }
    }
  }

 private:
  static Pose& pose_at(CalibrationState& state, const BlockId& block) {
    if (block.kind == BlockId::Kind::placement) return state.world_from_board[block.index];
    if (block.kind == BlockId::Kind::station) return state.world_from_probe[block.index];
    return state.rig.sensors[block.index].sensor_from_mount;
  }

  static std::vector<double> read(CalibrationState state, const BlockId& block) {
    if (block.kind == BlockId::Kind::lens) return state.rig.sensors[block.index].lens.parameters();
    if (block.kind == BlockId::Kind::warp) {
      const Eigen::Vector2d& warp = state.boards[block.index].warp_mm;
      return {warp.x(), warp.y()};
    }
    if (block.kind == BlockId::Kind::scale) return {state.boards[block.index].scale};
    if (block.kind == BlockId::Kind::led) {
      const Eigen::Vector3d& led = state.rig.leds[block.index].position_mm;
      return {led.x(), led.y(), led.z()};
    }
    std::vector<double> value(kPoseSize);
    PoseManifold::pack(pose_at(state, block), value.data());
    return value;
  }

  std::vector<double> values_;
  std::map<BlockId, std::pair<std::size_t, std::size_t>> spans_;  // offset and size in values_
};

// What a view or a prior contributes, whitened.
struct Rows {
  Eigen::VectorXd residuals;
  std::vector<RowMajorMatrix> jacobians;  // one per block
};

// Evaluates every view at Ceres's current point, in parallel, before Ceres asks for any of them.
class Evaluator final : public ceres::EvaluationCallback {
 public:
  Evaluator(const std::vector<std::unique_ptr<View>>& views, const std::vector<ViewWeights>& weights,
            const MinimiseOptions& options, const Blocks& blocks, CalibrationState state)
      : views_(views), weights_(weights), options_(options), blocks_(blocks), state_(std::move(state)) {
    rows_.resize(views.size());
    predicted_.resize(views.size());
  }

  void PrepareForEvaluation(bool evaluate_jacobians, bool) override {
    blocks_.write_to(state_);
    parallel_for(views_.size(), options_.threads, [&](std::size_t v) {
      ViewEvaluation evaluation;
      predicted_[v] = views_[v]->evaluate(state_, evaluate_jacobians, evaluation);
      if (!predicted_[v]) return;
      whiten(*views_[v], weights_[v], evaluation);
      if (options_.cauchy_scale) robustify(*views_[v], *options_.cauchy_scale, evaluation);
      discount(weights_[v], evaluation);
      Rows& rows = rows_[v];
      rows.jacobians.clear();
      for (std::size_t b = 0; evaluate_jacobians && b < views_[v]->blocks().size(); ++b) {
        rows.jacobians.emplace_back(block_jacobian(*views_[v], evaluation, state_, b));
      }
      rows.residuals = std::move(evaluation.residuals);
    });
    priors_.clear();
    for (const Prior& prior : options_.priors) {
      const WhitenedPrior whitened = prior.evaluate(state_);
      priors_.push_back({whitened.residuals, whitened.jacobians});
    }
  }

  // Null where the view could not be predicted.
  const Rows* of(std::size_t view) const { return predicted_[view] ? &rows_[view] : nullptr; }
  const Rows* prior(std::size_t index) const { return &priors_[index]; }

 private:
  const std::vector<std::unique_ptr<View>>& views_;
  const std::vector<ViewWeights>& weights_;
  const MinimiseOptions& options_;
  const Blocks& blocks_;
  CalibrationState state_;
  std::vector<Rows> rows_;
  std::vector<char> predicted_;
  std::vector<Rows> priors_;
};

// Residual blocks give their Jacobian in the tangent; Ceres wants it padded to the ambient size.
void pad(const RowMajorMatrix& tangent, int ambient_size, double* jacobian) {
  Eigen::Map<RowMajorMatrix> ambient(jacobian, tangent.rows(), ambient_size);
  ambient.setZero();
  ambient.leftCols(tangent.cols()) = tangent;
}

// Hands the rows to Ceres that `rows` returns: none where they could not be predicted. `columns` are the blocks among
// them that are estimated.
class RowsCost final : public ceres::CostFunction {
 public:
  RowsCost(std::function<const Rows*()> rows, int count, std::vector<std::size_t> columns,
           const std::vector<int>& block_sizes)
      : rows_(std::move(rows)), columns_(std::move(columns)) {
    set_num_residuals(count);
    *mutable_parameter_block_sizes() = block_sizes;
  }

  bool Evaluate(const double* const*, double* residuals, double** jacobians) const override {
    const Rows* const rows = rows_();
    if (rows == nullptr || !rows->residuals.allFinite()) return false;
    Eigen::Map<Eigen::VectorXd>(residuals, num_residuals()) = rows->residuals;
    for (std::size_t k = 0; jacobians != nullptr && k < columns_.size(); ++k) {
      if (jacobians[k] != nullptr) pad(rows->jacobians[columns_[k]], parameter_block_sizes()[k], jacobians[k]);
    }
    return true;
  }

 private:
  std::function<const Rows*()> rows_;
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

void add(std::function<const Rows*()> rows, int count, const std::vector<BlockId>& wanted, Blocks& blocks,
         ceres::Problem& problem) {
  const Columns columns(wanted, blocks);
  if (columns.pointers.empty()) return;
  problem.AddResidualBlock(new RowsCost(std::move(rows), count, columns.indices, columns.sizes), nullptr,
                           columns.pointers);
}

ceres::Solver::Options solver_options(const Parameters& parameters, Blocks& blocks,
                                      const MinimiseOptions& minimise_options) {
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::DENSE_SCHUR;
  options.linear_solver_ordering = std::make_shared<ceres::ParameterBlockOrdering>();
  for (const auto& [block, span] : blocks.spans()) {
    const int group = parameters.slot(block) ? 0 : 1;
    options.linear_solver_ordering->AddElementToGroup(blocks.data(block), group);
  }
  options.num_threads = 1;
  options.max_num_iterations = minimise_options.max_iterations;
  options.function_tolerance = 1e-14;
  options.gradient_tolerance = 1e-14;
  options.parameter_tolerance = 1e-14;
  options.jacobi_scaling = true;
  options.logging_type = ceres::SILENT;
  return options;
}

}  // namespace

Expected<CeresMinimum> minimise_by_ceres(const std::vector<std::unique_ptr<View>>& views,
                                         const std::vector<ViewWeights>& weights, const Parameters& parameters,
                                         const MinimiseOptions& options, CalibrationState& state) {
  Blocks blocks(state, parameters);
  Evaluator evaluator(views, weights, options, blocks, state);
  ceres::Problem::Options problem_options;
  problem_options.evaluation_callback = &evaluator;
  ceres::Problem problem(problem_options);
  for (std::size_t v = 0; v < views.size(); ++v) {
    add([&evaluator, v] { return evaluator.of(v); }, views[v]->size() * views[v]->dimension(), views[v]->blocks(),
        blocks, problem);
  }
  for (std::size_t p = 0; p < options.priors.size(); ++p) {
    const Prior& prior = options.priors[p];
    add([&evaluator, p] { return evaluator.prior(p); }, static_cast<int>(prior.terms().size()), prior.blocks(), blocks,
        problem);
  }
  for (const auto& [block, span] : blocks.spans()) {
    const bool pose = block.kind == BlockId::Kind::mount || block.is_pose();
    if (pose) problem.SetManifold(blocks.data(block), new PoseManifold);
  }

  ceres::Solver::Summary summary;
  ceres::Solve(solver_options(parameters, blocks, options), &problem, &summary);
  if (summary.termination_type == ceres::FAILURE) return fail(summary.message);
  blocks.write_to(state);
  return CeresMinimum{static_cast<int>(summary.iterations.size()), summary.termination_type == ceres::CONVERGENCE,
                      summary.final_cost};
}

}  // namespace crumple
