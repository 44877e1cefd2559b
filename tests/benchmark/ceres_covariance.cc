#include "tests/benchmark/ceres_covariance.h"

#include <map>
#include <stdexcept>

#include <ceres/ceres.h>

namespace crumple {
namespace {

// Residuals of no matter with a given Jacobian, one part per parameter block.
class GivenJacobian final : public ceres::CostFunction {
 public:
  explicit GivenJacobian(std::vector<RowMajorMatrix> parts) : parts_(std::move(parts)) {
    set_num_residuals(static_cast<int>(parts_[0].rows()));
    for (const RowMajorMatrix& part : parts_) {
      mutable_parameter_block_sizes()->push_back(static_cast<int>(part.cols()));
    }
  }
  bool Evaluate(const double* const*, double* residuals, double** jacobians) const override {
    std::fill_n(residuals, num_residuals(), 0.0);
    for (std::size_t i = 0; jacobians != nullptr && i < parts_.size(); ++i) {
      if (jacobians[i] != nullptr) std::copy_n(parts_[i].data(), parts_[i].size(), jacobians[i]);
    }
    return true;
  }

 private:
  std::vector<RowMajorMatrix> parts_;
};

}  // namespace

struct CeresCovariance::Problem {
  ceres::Problem ceres;
  std::map<BlockId, std::vector<double>> values;
  std::vector<BlockId> common;

  void add(const std::vector<BlockId>& blocks, const std::vector<RowMajorMatrix>& jacobians,
           const Parameters& parameters) {
    std::vector<RowMajorMatrix> parts;
    std::vector<double*> pointers;
    for (std::size_t b = 0; b < blocks.size(); ++b) {
      if (!parameters.estimated(blocks[b])) continue;
      auto& value = values[blocks[b]];
      value.resize(static_cast<std::size_t>(jacobians[b].cols()));
      parts.push_back(jacobians[b]);
      pointers.push_back(value.data());
    }
    ceres.AddResidualBlock(new GivenJacobian(parts), nullptr, pointers);
  }
};

CeresCovariance::CeresCovariance(const std::vector<std::unique_ptr<View>>& views, const Parameters& parameters,
                                 const std::vector<Prior>& priors, const CalibrationState& state)
    : problem_(std::make_unique<Problem>()) {
  problem_->common = parameters.common_blocks();
  for (const auto& view : views) {
    ViewEvaluation evaluation;
    view->evaluate(state, true, evaluation);
    std::vector<RowMajorMatrix> jacobians;
    for (std::size_t b = 0; b < view->blocks().size(); ++b) {
      jacobians.emplace_back(block_jacobian(*view, evaluation, state, b));
    }
    problem_->add(view->blocks(), jacobians, parameters);
  }
  for (const Prior& prior : priors) problem_->add(prior.blocks(), prior.evaluate(state).jacobians, parameters);
}

CeresCovariance::~CeresCovariance() = default;

Eigen::MatrixXd CeresCovariance::common() const {
  ceres::Covariance::Options options;
  options.algorithm_type = ceres::SPARSE_QR;
  ceres::Covariance covariance(options);
  std::vector<const double*> blocks;
  int size = 0;
  for (const BlockId& block : problem_->common) {
    blocks.push_back(problem_->values.at(block).data());
    size += static_cast<int>(problem_->values.at(block).size());
  }
  RowMajorMatrix matrix(size, size);
  if (!covariance.Compute(blocks, &problem_->ceres) || !covariance.GetCovarianceMatrix(blocks, matrix.data())) {
    throw std::runtime_error("ceres::Covariance refuses the problem");
  }
  return matrix;
}

}  // namespace crumple
