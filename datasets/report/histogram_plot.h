// A group's residuals against the normal distribution.
#pragma once

#include "calib/residual_histogram.h"
#include "datasets/report/gnuplot.h"

namespace crumple {

// On a logarithmic scale, where the normal curve is a parabola and tails show.
Plot histogram_plot(const ResidualHistogram& histogram);

}  // namespace crumple
