// What is known of parameters before anything is observed: an earlier rig with its covariance, a certificate, or a weak
// prior that holds terms the observations cannot tell apart.
//
// It enters a refinement and its covariance as one more observation: the whitened difference
//   r = L^-1 d,   d = the state minus what the prior is about, in tangents (solvers/pose.h),   L L' = covariance of d,
// exact also where a pose has turned far away: d r / d tangent holds the inverse left Jacobian of the rotation
// (Barfoot, State Estimation for Robotics, eq. 7.76). Units are the parameters' own: px, rad, mm.
#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>

#include "solvers/expected.h"
#include "solvers/residuals.h"

namespace crumple {

// One row of a block's tangent, such as parameter 9 of the lens of sensor 0.
struct PriorTerm {
  BlockId block;
  int row = 0;
  auto operator<=>(const PriorTerm&) const = default;
};

struct WhitenedPrior {
  Eigen::VectorXd residuals;
  std::vector<RowMajorMatrix> jacobians;  // one per block, by its tangent, in the order of Prior::blocks
};

class Prior {
 public:
  // `covariance` has its rows in the order of the terms. Fails where that is not positive definite, and on a term given
  // twice. At most one of the blocks may be a pose of
  // placement or station.
  static Expected<Prior> create(std::string name, std::vector<PriorTerm> terms, CalibrationState about,
                                const Eigen::MatrixXd& covariance);

  // The same prior as one that states no knowledge: where it decides a term, that term counts as undetermined
  // (solvers/undetermined.h).
  Prior as_weak() const;
  bool weak() const { return weak_; }

  const std::string& name() const { return name_; }
  const std::vector<PriorTerm>& terms() const { return terms_; }
  const std::vector<BlockId>& blocks() const { return blocks_; }

  Eigen::VectorXd sigmas() const;  // of the terms

  WhitenedPrior evaluate(const CalibrationState& state) const;

 private:
  Prior(std::string name, std::vector<PriorTerm> terms, CalibrationState about, Eigen::MatrixXd root);

  std::string name_;
  std::vector<PriorTerm> terms_;
  std::vector<BlockId> blocks_;  // each once, in the order of the terms
  CalibrationState about_;
  Eigen::MatrixXd root_;  // L^-1
  bool weak_ = false;
};

}  // namespace crumple
