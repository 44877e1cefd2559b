#include "calib/correlation.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace crumple {
namespace {

constexpr std::size_t kRings = 40;

// The pixels and residuals of one view.
using Residuals = std::pair<const std::vector<Eigen::Vector2d>*, const ViewSummary*>;

struct Correlogram {
  std::vector<double> products = std::vector<double>(kRings, 0.0);
  std::vector<double> pairs = std::vector<double>(kRings, 0.0);
  double squares = 0;
  double count = 0;
};

void add_view(const Residuals& view, double ring_px, Correlogram& sums) {
  const auto& [pixels, summary] = view;
  const auto dimension =
      summary->residuals_px.size() / static_cast<Eigen::Index>(std::max<std::size_t>(1, pixels->size()));
  const auto residual = [&, s = summary](std::size_t i) {
    return s->residuals_px.segment(dimension * static_cast<Eigen::Index>(i), dimension);
  };
  for (std::size_t i = 0; i < pixels->size(); ++i) {
    if (!summary->inlier[i]) continue;
    sums.squares += residual(i).squaredNorm();
    sums.count += 1;
    for (std::size_t j = i + 1; j < pixels->size(); ++j) {
      if (!summary->inlier[j]) continue;
      const double distance = ((*pixels)[i] - (*pixels)[j]).norm();
      const auto ring = static_cast<std::size_t>(std::lround(distance / ring_px));
      if (ring >= kRings) continue;
      sums.products[ring] += residual(i).dot(residual(j));
      sums.pairs[ring] += 1;
    }
  }
}

double inflation_of(const std::vector<Residuals>& views, double ring_px) {
  Correlogram sums;
  for (const Residuals& view : views) add_view(view, ring_px, sums);
  if (!(sums.squares > 0)) return 1;
  const double variance = sums.squares / sums.count;
  double inflation = 1;
  for (std::size_t ring = 0; ring < kRings; ++ring) {
    if (sums.pairs[ring] == 0) continue;
    const double correlation = sums.products[ring] / sums.pairs[ring] / variance;
    if (correlation <= 1 / std::sqrt(sums.pairs[ring])) break;
    inflation += 2 * sums.pairs[ring] / sums.count * correlation;
  }
  return inflation;
}

double mean_spacing_px(const std::vector<CornerView>& views) {
  double sum = 0, count = 0;
  for (const CornerView& view : views) {
    for (const Eigen::Vector2d& pixel : view.pixels) {
      double nearest = std::numeric_limits<double>::infinity();
      for (const Eigen::Vector2d& other : view.pixels) {
        if (&other != &pixel) nearest = std::min(nearest, (other - pixel).norm());
      }
      if (!std::isfinite(nearest)) continue;
      sum += nearest;
      count += 1;
    }
  }
  return count > 0 ? std::max(1.0, sum / count) : 1;
}

}  // namespace

Inflation inflation(const Observations& observations, const BundleResult& bundle) {
  std::vector<Residuals> corners, stripes;
  for (const ViewSummary& summary : bundle.views) {
    if (summary.kind == View::Kind::corners)
      corners.emplace_back(&observations.corners[corners.size()].pixels, &summary);
    if (summary.kind == View::Kind::stripes) {
      stripes.emplace_back(&observations.stripes[stripes.size()].camera_pixels, &summary);
    }
  }
  constexpr double kStripeCell_px = 12;
  return {inflation_of(corners, mean_spacing_px(observations.corners)), inflation_of(stripes, kStripeCell_px)};
}

}  // namespace crumple
