// What observations would tell of parameters, and what that does to a covariance: the arithmetic of planning.
//
// The information of observations is J'J of the refinement's own whitened Jacobians (solvers/residuals.h), dense, about
// the given blocks in their order. A parameter that only these observations have, the pose of a new placement, is taken
// out by the Schur complement. With Lambda what is left, parameters of covariance C know
//   (C^-1 + Lambda)^-1 = C - C M C,   M = L (I + L'C L)^-1 L',   Lambda = L L'
// afterwards; exact where the model is linear, and independent of what the observations turn out to be.
#pragma once

#include <functional>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "solvers/observations.h"
#include "solvers/residuals.h"
#include "solvers/weights.h"

namespace crumple {

// Of views that are to be; `inlier` is not looked at.
using WeightOf = std::function<ViewWeights(const View&)>;

// All other blocks are held. None where an observation cannot be predicted.
std::optional<Eigen::MatrixXd> information(const Observations& observations, const CalibrationState& state,
                                           const WeightOf& weight_of, const std::vector<BlockId>& blocks);

// The information about the first rows, the last ones being free: their Schur complement. None where these are not
// determined.
std::optional<Eigen::MatrixXd> without_last(const Eigen::MatrixXd& information, Eigen::Index rows);

// M above.
Eigen::MatrixXd gain_of(const Eigen::MatrixXd& information, const Eigen::MatrixXd& covariance);

}  // namespace crumple
