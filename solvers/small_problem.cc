#include "solvers/small_problem.h"

#include <cmath>

#include <ceres/ceres.h>
#include <fmt/format.h>

#include "solvers/decompositions.h"

namespace crumple {
namespace {

constexpr double kUndetermined = 1e-12;

class SmallCost final : public ceres::CostFunction {
 public:
  SmallCost(const SmallProblem& problem, int parameters) : problem_(problem), parameters_(parameters) {
    set_num_residuals(problem.residuals);
    mutable_parameter_block_sizes()->push_back(parameters);
  }

  bool Evaluate(const double* const* x, double* residuals, double** jacobians) const override {
    const bool with_jacobian = jacobians != nullptr && jacobians[0] != nullptr;
    Eigen::VectorXd r(num_residuals());
    Eigen::MatrixXd jacobian(with_jacobian ? num_residuals() : 0, parameters_);
    const Eigen::Map<const Eigen::VectorXd> at(x[0], parameters_);
    if (!problem_.evaluate(at, r, with_jacobian ? &jacobian : nullptr)) return false;
    if (!r.allFinite() || !jacobian.allFinite()) return false;
    Eigen::Map<Eigen::VectorXd>(residuals, num_residuals()) = r;
    if (with_jacobian) {
      using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
      Eigen::Map<RowMajor>(jacobians[0], num_residuals(), parameters_) = jacobian;
    }
    return true;
  }

 private:
  const SmallProblem& problem_;
  int parameters_;
};

ceres::Solver::Options solver_options(int max_iterations) {
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::DENSE_QR;
  options.max_num_iterations = max_iterations;
  // As far as the digits carry: the step after the last that lowers the cost would be lost in rounding.
  options.function_tolerance = 1e-16;
  options.gradient_tolerance = 1e-25;
  options.parameter_tolerance = 1e-14;
  options.max_num_consecutive_invalid_steps = 50;
  options.logging_type = ceres::SILENT;
  return options;
}

}  // namespace

Expected<SmallSolution> solve(const SmallProblem& problem, const Eigen::VectorXd& start,
                              const SmallProblemOptions& options) {
  const int n = static_cast<int>(start.size()), redundancy = problem.residuals - n;
  if (redundancy < 0 || (redundancy == 0 && !options.sigma)) {
    return fail(fmt::format("{} residuals do not determine {} parameters and their uncertainty", problem.residuals, n));
  }
  SmallSolution solution;
  solution.x = start;
  ceres::Problem ceres_problem;
  ceres_problem.AddResidualBlock(new SmallCost(problem, n), nullptr, solution.x.data());
  ceres::Solver::Summary summary;
  ceres::Solve(solver_options(options.max_iterations), &ceres_problem, &summary);
  if (summary.termination_type == ceres::FAILURE) {
    return fail(fmt::format("the fit failed ({}): the start is too far from the data", summary.message));
  }
  solution.iterations = static_cast<int>(summary.iterations.size());
  Eigen::VectorXd residuals(problem.residuals);
  Eigen::MatrixXd jacobian(problem.residuals, n);
  if (!problem.evaluate(solution.x, residuals, &jacobian)) return fail("the fit ended where the model has no value");
  solution.sum_of_squares = residuals.squaredNorm();
  solution.sigma = options.sigma ? *options.sigma : std::sqrt(solution.sum_of_squares / redundancy);
  const auto inverse = inverse_gram(jacobian, kUndetermined);
  if (!inverse) return fail("the data do not determine all parameters of the fit");
  solution.covariance = solution.sigma * solution.sigma * *inverse;
  return solution;
}

}  // namespace crumple
