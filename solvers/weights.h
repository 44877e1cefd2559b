// How each observation of a view counts: divided by its group's sigma, left out as an outlier, or tamed by a robust
// loss while the solve still converges.
#pragma once

#include <vector>

#include "solvers/residuals.h"

namespace crumple {

struct ViewWeights {
  double sigma_px = 1;
  double inflation = 1;      // of the variance, for observations whose errors are correlated
  std::vector<char> inlier;  // one per observation; 0 leaves it out
};

// Divides residuals and Jacobian by sigma and blanks the outliers' rows.
void whiten(const View& view, const ViewWeights& weights, ViewEvaluation& evaluation);

// Lets correlated observations count for their effective number: divides by the square root of the inflation. After
// robustify, which looks at each observation by its own sigma.
void discount(const ViewWeights& weights, ViewEvaluation& evaluation);

// Turns each whitened observation r into g(s) r, s = |r|^2, g = sqrt(rho(s) / s), so that its square is the Cauchy loss
// rho(s) = c^2 log(1 + s / c^2) exactly, with the exact derivative g I + 2 g' r r'.
void robustify(const View& view, double cauchy_scale, ViewEvaluation& evaluation);

}  // namespace crumple
