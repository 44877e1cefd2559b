#include "calib/residual_histogram.h"

#include <cmath>

namespace crumple {
namespace {

constexpr auto kBins = static_cast<std::size_t>(2 * kHistogramReach / kHistogramBin);

// What the accepted coordinates add up to.
struct Moments {
  double count = 0;
  double sum = 0;
  double square = 0;
};

void add_coordinate(double sigmas, bool accepted, ResidualHistogram& histogram, Moments& moments) {
  if (accepted) {
    ++moments.count;
    moments.sum += sigmas;
    moments.square += sigmas * sigmas;
  }
  const double bin = std::floor((sigmas + kHistogramReach) / kHistogramBin);
  if (bin < 0 || bin >= static_cast<double>(kBins)) {
    ++histogram.beyond;
  } else {
    ++(accepted ? histogram.accepted : histogram.outliers)[static_cast<std::size_t>(bin)];
  }
}

}  // namespace

std::vector<ResidualHistogram> residual_histograms(const BundleResult& bundle) {
  std::vector<ResidualHistogram> histograms;
  for (const GroupSummary& group : bundle.groups) {
    ResidualHistogram histogram{group_name(bundle.state.rig, group.sensor, group.kind), std::vector<std::size_t>(kBins),
                                std::vector<std::size_t>(kBins)};
    Moments moments;
    for (const ViewSummary& view : bundle.views) {
      if (view.sensor != group.sensor || view.kind != group.kind) continue;
      const Eigen::Index dimension = View::dimension_of(view.kind);
      for (Eigen::Index row = 0; row < view.residuals_px.size(); ++row) {
        add_coordinate(view.residuals_px[row] / group.sigma_px,
                       view.inlier[static_cast<std::size_t>(row / dimension)] != 0, histogram, moments);
      }
    }
    if (moments.count > 0) {
      histogram.mean = moments.sum / moments.count;
      histogram.deviation = std::sqrt(std::max(0.0, moments.square / moments.count - histogram.mean * histogram.mean));
    }
    histograms.push_back(std::move(histogram));
  }
  return histograms;
}

}  // namespace crumple
