// What is known of parameters before anything is observed: an earlier rig with its covariance, a certificate, a scale
// bar between two LEDs, or a weak prior that holds terms the observations cannot tell apart.
//
// It enters a refinement and its covariance as one more observation: the whitened difference
//   r = L^-1 d,   d = the state minus what the prior is about, in tangents (solvers/pose.h),   L L' = covariance of d,
// exact also where a pose has turned far away: d r / d tangent holds the inverse left Jacobian of the rotation
// (Barfoot, State Estimation for Robotics, eq. 7.76). Units are the parameters' own: px, rad, mm.
// Of distances between LEDs d is each distance less its known length, mm.
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

// Two LEDs, or reference points, on the same mount, whose distance is known.
struct LedDistance {
  std::size_t from = 0;
  std::size_t to = 0;
  double length_mm = 0;
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

  // A known length, or several with what is common to them: one bar put down at three places is three distances whose
  // covariance is that of the certificate in every element, and of the placing on the diagonal. Fails as create does.
  static Expected<Prior> of_distances(std::string name, std::vector<LedDistance> distances,
                                      const Eigen::MatrixXd& covariance);

  // The same prior as one that states no knowledge: where it decides a term, that term counts as undetermined
  // (solvers/undetermined.h).
  Prior as_weak() const;
  bool weak() const { return weak_; }

  const std::string& name() const { return name_; }
  const std::vector<PriorTerm>& terms() const { return terms_; }  // none of distances
  const std::vector<BlockId>& blocks() const { return blocks_; }

  Eigen::VectorXd sigmas() const;  // of the terms or distances

  WhitenedPrior evaluate(const CalibrationState& state) const;

 private:
  Prior(std::string name, std::vector<PriorTerm> terms, CalibrationState about, Eigen::MatrixXd root);
  WhitenedPrior evaluate_terms(const CalibrationState& state) const;
  WhitenedPrior evaluate_distances(const CalibrationState& state) const;

  std::string name_;
  std::vector<PriorTerm> terms_;
  std::vector<LedDistance> distances_;  // in place of terms
  std::vector<BlockId> blocks_;         // each once, in the order of the terms
  CalibrationState about_;
  Eigen::MatrixXd root_;  // L^-1
  bool weak_ = false;
};

}  // namespace crumple
