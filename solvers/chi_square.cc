#include "solvers/chi_square.h"

#include <algorithm>
#include <cmath>

namespace crumple {

double chi_square_tail(double x, int degrees) {
  if (degrees <= 0 || !(x > 0)) return 1;
  const double half = x / 2;
  const bool odd = degrees % 2 == 1;
  double tail = odd ? std::erfc(std::sqrt(half)) : 0;
  // Each term (x/2)^a e^(-x/2) / Gamma(a + 1), in logarithms so that large x do not underflow early.
  for (double a = odd ? 0.5 : 0; a < degrees / 2.0 - 0.25; a += 1) {
    tail += std::exp(a * std::log(half) - half - std::lgamma(a + 1));
  }
  return std::clamp(tail, 0.0, 1.0);
}

}  // namespace crumple
