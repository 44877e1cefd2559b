#include "calib/correlated_terms.h"

#include <algorithm>
#include <cmath>

namespace crumple {

CorrelatedTerms correlated_terms(const RigCovariance& covariance) {
  CorrelatedTerms terms;
  const Eigen::VectorXd sigma = covariance.matrix.diagonal().cwiseSqrt();
  // How bodies move on average is no parameter.
  const auto of_bodies = [&](Eigen::Index i) {
    return covariance.names[static_cast<std::size_t>(i)].find(".datum_") != std::string::npos;
  };
  for (Eigen::Index i = 0; i < sigma.size(); ++i) {
    if (of_bodies(i)) continue;
    for (Eigen::Index j = i + 1; j < sigma.size(); ++j) {
      if (of_bodies(j)) continue;
      const double correlation = covariance.matrix(i, j) / (sigma[i] * sigma[j]);
      if (!(std::abs(correlation) > kCorrelationLimit)) continue;
      terms.strongest.push_back(
          {covariance.names[static_cast<std::size_t>(i)], covariance.names[static_cast<std::size_t>(j)], correlation});
    }
  }
  terms.pairs = terms.strongest.size();
  std::stable_sort(terms.strongest.begin(), terms.strongest.end(),
                   [](const auto& a, const auto& b) { return std::abs(a.correlation) > std::abs(b.correlation); });
  terms.strongest.resize(std::min(terms.pairs, kCorrelatedPairsTold));
  return terms;
}

}  // namespace crumple
