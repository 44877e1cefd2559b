// The covariance of a joint refinement, from its normal equations.
//
// WARNING: this is the linear propagation of independent, whitened observation noise at the optimum. It is true only
// for the final solve: without robust loss, with sigma as estimated, outliers left out.
//
// With the whitened Jacobian split into common parameters a and the eliminated poses b_j (nuisance, 6 each),
//   J'J = [ A  B_j ; B_j'  D_j ],   S = A - sum_j B_j D_j^-1 B_j'          (Schur complement)
//   cov(a) = S^-1,  cov(a, b_j) = -S^-1 B_j D_j^-1,  cov(b_j) = D_j^-1 + D_j^-1 B_j' S^-1 B_j D_j^-1.
// S is equilibrated to a unit diagonal before it is factored. Where its smallest equilibrated eigenvalue lies below
// 1e-12 the parameters are not determined: that is an error which names the direction. Directions that only a weak
// prior holds may lie below that; where there is one, the Jacobian's triangular square root (solvers/square_root.h)
// decides, which is good to singular values of 1e-10 of the largest. What digits squaring the Jacobian has cost
// otherwise, sharpen() brings back.
//
// Gauge: the reference sensor's mount is held, so every row is relative to that sensor's frame.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "solvers/expected.h"
#include "solvers/normal_equations.h"

namespace crumple {

// Numbers that are linear in the tangents of blocks: the sum of their matrices times these. Row i is names[i].
struct TangentFunction {
  std::vector<std::string> names = {};
  std::map<BlockId, Eigen::MatrixXd> by_block = {};
};

class JointCovariance {
 public:
  // `square_root` makes reduced_square_root of the same views; given where a weak prior takes part.
  static Expected<JointCovariance> create(const NormalEquations& equations, const CalibrationState& state,
                                          const std::function<Eigen::MatrixXd()>& square_root = {});

  // Takes cov(a) from the Jacobian's triangular square root where the condition asks for it.
  // The arguments are those the equations were made from.
  void sharpen(const std::vector<std::unique_ptr<View>>& views, const NormalEquations::Evaluate& evaluate,
               const std::vector<Prior>& priors, const CalibrationState& state, int threads);

  // Adds what the propagation does not know of (calib/weighting.h) to cov(a); eliminated poses follow by their gains.
  void widen(const Eigen::MatrixXd& by);
  const Eigen::MatrixXd& widening() const { return widening_; }  // empty unless it was
  Eigen::MatrixXd before_widening(const std::vector<BlockId>& blocks, const CalibrationState& state) const;

  // Of the common parameters; row i is names()[i], such as "cam0.fx" or "board.warp_x".
  const Eigen::MatrixXd& common() const { return common_; }
  const std::vector<std::string>& names() const { return names_; }
  // How many of these, the first ones, are no poses of placements or stations.
  int rig_rows() const;
  // Joint covariance of the given blocks, each given once, in their order; zero rows for held blocks.
  Eigen::MatrixXd of(const std::vector<BlockId>& blocks, const CalibrationState& state) const;

  const Parameters& parameters() const { return parameters_; }
  // Of an eliminated pose, by its slot there: B_j D_j^-1, and D_j^-1.
  const Eigen::Matrix<double, Eigen::Dynamic, 6>& gain(std::size_t slot) const { return gain_[slot]; }
  const Matrix6d& pose_inverse(std::size_t slot) const { return pose_inverse_[slot]; }
  // Of the rig's rows, the first rig_rows() of the common parameters, and below them of a function; without those of
  // its rows that only held blocks enter.
  RigCovariance of_rig_and(const TangentFunction& function) const;

  // Condition of the equilibrated information matrix, and its weakest direction in words; 0 and empty where poses only
  // are estimated.
  double condition() const { return condition_; }
  const std::string& weakest_direction() const { return weakest_direction_; }

 private:
  // False where the parameters are not determined.
  bool take(const Eigen::MatrixXd& square_root);
  Eigen::MatrixXd joint(const std::vector<BlockId>& blocks, const CalibrationState& state,
                        const Eigen::MatrixXd& common) const;
  explicit JointCovariance(const Parameters& parameters) : parameters_(parameters) {}

  Parameters parameters_;
  std::vector<std::string> names_;
  Eigen::MatrixXd common_;
  Eigen::MatrixXd widening_;                                    // that is in common_ already
  std::vector<Eigen::Matrix<double, Eigen::Dynamic, 6>> gain_;  // B_j D_j^-1, as Parameters::eliminated
  std::vector<Matrix6d> pose_inverse_;                          // D_j^-1
  double condition_ = 0;
  std::string weakest_direction_;
};

}  // namespace crumple
