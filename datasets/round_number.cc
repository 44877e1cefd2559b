#include "datasets/round_number.h"

#include <cmath>

namespace crumple {

double largest_round_below(double value) {
  const double power = std::pow(10, std::floor(std::log10(value)));
  for (const double digit : {5.0, 2.0}) {
    if (digit * power <= value * (1 + 1e-9)) return digit * power;
  }
  return power;
}

}  // namespace crumple
