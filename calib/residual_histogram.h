// How the residuals of a group of observations are distributed, each coordinate over its group's sigma: noise alone
// makes it the normal distribution of width 1 (a little narrower, since the fit follows the noise by what parameters
// and observations have in common). Shoulders are errors of the model, far tails outliers.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "solvers/bundle.h"

namespace crumple {

struct ResidualHistogram {
  std::string group;                  // "cam0.corners"
  std::vector<std::size_t> accepted;  // coordinates per bin, from -kHistogramReach on
  std::vector<std::size_t> outliers;  // coordinates of observations left out
  std::size_t beyond = 0;             // coordinates outside of the bins
  double mean = 0;                    // of the accepted, in sigmas
  double deviation = 0;               // standard deviation of the accepted, in sigmas
};

inline constexpr double kHistogramReach = 5;   // sigmas to either side
inline constexpr double kHistogramBin = 0.25;  // width, sigmas

// One per group, in the groups' order.
std::vector<ResidualHistogram> residual_histograms(const BundleResult& bundle);

}  // namespace crumple
