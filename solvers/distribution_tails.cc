#include "solvers/distribution_tails.h"

#include <cmath>

#include <boost/math/distributions/chi_squared.hpp>
#include <boost/math/distributions/non_central_chi_squared.hpp>
#include <boost/math/special_functions/beta.hpp>
#include <boost/math/special_functions/gamma.hpp>

namespace crumple {

double chi_square_tail(double x, int degrees) {
  if (degrees <= 0 || !(x > 0)) return 1;
  return std::isfinite(x) ? boost::math::gamma_q(degrees / 2.0, x / 2) : 0;
}

double chi_square_exceeded(double probability, int degrees) {
  return boost::math::quantile(boost::math::complement(boost::math::chi_squared(degrees), probability));
}

double noncentrality_seen(double x, int degrees, double power) {
  return boost::math::non_central_chi_squared::find_non_centrality(degrees, x, 1 - power);
}

double f_tail(double f, int degrees, double of_variance) {
  if (degrees <= 0 || !(f > 0)) return 1;
  if (!std::isfinite(of_variance)) return chi_square_tail(f * degrees, degrees);
  if (!std::isfinite(f)) return 0;
  return boost::math::ibetac(degrees / 2.0, of_variance / 2, degrees * f / (of_variance + degrees * f));
}

}  // namespace crumple
