// The gate beyond which a standardised squared residual is an outlier (solvers/bundle.h), in one dimension and two.
#pragma once

namespace crumple {

// The gate in one dimension that clean data exceeds as often as `gate` in two; in two dimensions `gate` itself.
double gate_for(int dimension, double gate);

// The variance left, of one, in a chi-square distribution of 1 or 2 dimensions cut at its gate.
double kept_variance(int dimension, double gate);

}  // namespace crumple
