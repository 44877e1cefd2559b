// The chi-square distribution's upper tail, for tests of how well a fit explains its observations.
#pragma once

namespace crumple {

// P(chi-square of that many degrees of freedom > x), by the finite sums for even and odd degrees (Abramowitz & Stegun,
// 26.4.4 and 26.4.5). 1 with no degrees of freedom or x <= 0. Good to 1e-12 up to some hundred degrees.
double chi_square_tail(double x, int degrees);

}  // namespace crumple
