#include "datasets/report/histogram_plot.h"

#include <algorithm>
#include <numeric>

#include <fmt/format.h>

namespace crumple {

Plot histogram_plot(const ResidualHistogram& histogram) {
  std::vector<std::vector<double>> rows;
  std::size_t most = 1;
  for (std::size_t b = 0; b < histogram.accepted.size(); ++b) {
    const std::size_t both = histogram.accepted[b] + histogram.outliers[b];
    const double centre = -kHistogramReach + (static_cast<double>(b) + 0.5) * kHistogramBin;
    rows.push_back({centre, static_cast<double>(histogram.accepted[b]), static_cast<double>(both)});
    most = std::max(most, both);
  }
  const auto accepted =
      static_cast<double>(std::accumulate(histogram.accepted.begin(), histogram.accepted.end(), std::size_t{0}));
  return {470, 300,
          gnuplot_data("bins", rows) +
              fmt::format("set logscale y\nset yrange [0.5:{}]\nset xrange [-{}:{}]\nset tics out nomirror\n"
                          "set xlabel 'residual / sigma'\nset ylabel 'coordinates per bin'\nset border 3 lw 0.8\n"
                          "set boxwidth {}\nset style fill solid 1 noborder\nset samples 200\nset format y '%g'\n"
                          "set key at graph 1,1.12 horizontal right samplen 1.5\nset tmargin 2\n"
                          "normal(x) = {} * exp(-x * x / 2) / sqrt(2 * pi)\n",
                          3.0 * static_cast<double>(most), kHistogramReach, kHistogramReach, kHistogramBin * 0.92,
                          accepted * kHistogramBin) +
              "plot $bins using 1:3 with boxes lc rgb '#d55e00' title 'outliers', "
              "$bins using 1:2 with boxes lc rgb '#8ab6d6' title 'accepted', "
              "normal(x) with lines lw 1.6 lc rgb '#000000' title 'normal'\n"};
}

}  // namespace crumple
