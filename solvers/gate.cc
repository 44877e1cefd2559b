#include "solvers/gate.h"

#include <cmath>
#include <numbers>

namespace crumple {

double gate_for(int dimension, double gate) {
  if (dimension == 2) return gate;
  // P(|z| > t) = erfc(t / sqrt 2) = exp(-gate / 2), by bisection.
  const double probability = std::exp(-gate / 2);
  double low = 0, high = std::sqrt(gate);
  for (int i = 0; i < 60; ++i) {
    const double middle = 0.5 * (low + high);
    (std::erfc(middle / std::numbers::sqrt2) > probability ? low : high) = middle;
  }
  return low * low;
}

double kept_variance(int dimension, double gate) {
  const double outside = std::exp(-gate / 2);
  if (dimension == 2) return 1 - 0.5 * gate * outside / (1 - outside);
  const double t = std::sqrt(gate_for(1, gate));
  const double density = std::exp(-t * t / 2) / std::sqrt(2 * std::numbers::pi);
  return 1 - 2 * t * density / (1 - outside);
}

}  // namespace crumple
