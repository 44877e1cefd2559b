#include "calib/correlation.h"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace crumple {
namespace {

constexpr double kRing_px = 12;
constexpr std::size_t kRings = 40;

struct Correlogram {
  std::vector<double> products = std::vector<double>(kRings, 0.0);
  std::vector<double> pairs = std::vector<double>(kRings, 0.0);
  double squares = 0;
  double readings = 0;
};

void add_view(const StripeView& view, const ViewSummary& summary, Correlogram& sums) {
  const std::size_t count = view.camera_pixels.size();
  for (std::size_t i = 0; i < count; ++i) {
    if (!summary.inlier[i]) continue;
    const double r = summary.residuals_px[static_cast<Eigen::Index>(i)];
    sums.squares += r * r;
    sums.readings += 1;
    for (std::size_t j = i + 1; j < count; ++j) {
      if (!summary.inlier[j]) continue;
      const double distance = (view.camera_pixels[i] - view.camera_pixels[j]).norm();
      const auto ring = static_cast<std::size_t>(distance / kRing_px);
      if (ring >= kRings) continue;
      sums.products[ring] += r * summary.residuals_px[static_cast<Eigen::Index>(j)];
      sums.pairs[ring] += 1;
    }
  }
}

}  // namespace

double stripe_inflation(const std::vector<StripeView>& views, const BundleResult& bundle) {
  Correlogram sums;
  std::size_t next = 0;
  for (const ViewSummary& summary : bundle.views) {
    if (summary.kind != View::Kind::stripes) continue;
    assert(next < views.size());
    add_view(views[next++], summary, sums);
  }
  if (!(sums.squares > 0)) return 1;
  const double variance = sums.squares / sums.readings;
  double inflation = 1;
  for (std::size_t ring = 0; ring < kRings; ++ring) {
    if (sums.pairs[ring] == 0) continue;
    const double correlation = sums.products[ring] / sums.pairs[ring] / variance;
    if (correlation <= 0) break;
    const double neighbours = 2 * sums.pairs[ring] / sums.readings;
    inflation += neighbours * correlation;
  }
  return inflation;
}

}  // namespace crumple
