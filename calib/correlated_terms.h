// Parameters of a rig that the observations can hardly tell apart: pairs whose estimates move together. Single sigmas
// of such a pair mean little; what both predict together may be known well.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "solvers/rig.h"

namespace crumple {

struct CorrelatedPair {
  std::string first;  // rows of the covariance
  std::string second;
  double correlation = 0;
};

struct CorrelatedTerms {
  std::size_t pairs = 0;                  // above the limit
  std::vector<CorrelatedPair> strongest;  // of these at most kCorrelatedPairsTold, strongest first
};

inline constexpr double kCorrelationLimit = 0.95;  // in magnitude
inline constexpr std::size_t kCorrelatedPairsTold = 30;

CorrelatedTerms correlated_terms(const RigCovariance& covariance);

}  // namespace crumple
