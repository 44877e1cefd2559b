// The normal equations of whitened views, J'J x = -J'r, split into the common parameters a and the eliminated poses
// b_j (of placements or stations, solvers/parameters.h):
//
//   J'J = [ A  B_j ; B_j'  D_j ]        A: common x common, D_j: 6 x 6, no b_j meets another
//
// They are summed up view by view, so that no more than one view's Jacobian per thread is ever held: memory and time
// grow with the number of views, not with its square. The sums run in a fixed order whatever the thread count: views
// are grouped by pose, poses into a number of parts that depends on the data alone, and parts are added one
// after the other.
//
// solve() is one step of Levenberg and Marquardt: (H + damping diag(H)) x = -J'r through the Schur complement
// A - sum_j B_j D_j^-1 B_j' of the matrix equilibrated to a unit diagonal.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "solvers/parameters.h"
#include "solvers/prior.h"

namespace crumple {

struct PoseEquations {
  Matrix6d information = Matrix6d::Zero();            // D_j
  Eigen::Matrix<double, Eigen::Dynamic, 6> coupling;  // B_j
  Vector6d gradient = Vector6d::Zero();
};

struct DampedStep {
  Eigen::VectorXd tangent;        // in the order of Parameters
  double predicted_decrease = 0;  // of half the sum of squares, by the linearised model
};

class NormalEquations {
 public:
  // `parameters` must outlive the equations.
  explicit NormalEquations(const Parameters& parameters);

  // Adds a whitened view.
  void add(const View& view, const ViewEvaluation& whitened);
  // A prior counts as one more observation.
  void add(const Prior& prior, const CalibrationState& state);

  // Evaluates view v, whitened, with its Jacobian; false where it cannot be predicted.
  using Evaluate = std::function<bool(std::size_t v, ViewEvaluation&)>;
  // The equations of all views; none where one of them cannot be predicted.
  static std::optional<NormalEquations> of(const std::vector<std::unique_ptr<View>>& views,
                                           const Parameters& parameters, const Evaluate& evaluate, int threads);

  // No value where the damped matrix is not positive definite to rounding.
  std::optional<DampedStep> solve(double damping, int threads) const;

  const Parameters& parameters() const { return *parameters_; }
  const Eigen::MatrixXd& common() const { return sums_.information; }  // A
  const Eigen::VectorXd& common_gradient() const { return sums_.gradient; }
  const std::vector<PoseEquations>& eliminated() const { return poses_; }  // as Parameters::eliminated
  double cost() const { return sums_.cost; }                               // half the sum of squares

 private:
  struct CommonSums {
    Eigen::MatrixXd information;
    Eigen::VectorXd gradient;
    double cost = 0;
  };
  void add(const View& view, const ViewEvaluation& whitened, CommonSums& sums);
  // Information and gradient by the tangents of blocks, side by side; at most one of them is a pose.
  void scatter(const std::vector<BlockId>& blocks, const Eigen::MatrixXd& information, const Eigen::VectorXd& gradient,
               CommonSums& sums);

  const Parameters* parameters_;
  CommonSums sums_;
  std::vector<PoseEquations> poses_;
};

}  // namespace crumple
