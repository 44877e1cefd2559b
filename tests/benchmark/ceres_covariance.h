// The same Jacobian through ceres::Covariance, block by block, by sparse QR.
#pragma once

#include <memory>
#include <vector>

#include <Eigen/Core>

#include "solvers/parameters.h"
#include "solvers/prior.h"

namespace crumple {

class CeresCovariance {
 public:
  CeresCovariance(const std::vector<std::unique_ptr<View>>& views, const Parameters& parameters,
                  const std::vector<Prior>& priors, const CalibrationState& state);
  ~CeresCovariance();

  // Of the common parameters; throws std::runtime_error where Ceres refuses.
  Eigen::MatrixXd common() const;

 private:
  struct Problem;
  std::unique_ptr<Problem> problem_;
};

}  // namespace crumple
