#include "calib/telling_readings.h"

#include <iterator>
#include <map>
#include <utility>

namespace crumple {
namespace {

struct LedCount {
  int read = 0;
  int left_out = 0;
  bool changed() const { return 2 * left_out > read; }
};

}  // namespace

std::vector<StripeView> accepted_stripes(const std::vector<StripeView>& all, const std::vector<ViewSummary>& views) {
  std::vector<StripeView> kept;
  auto stripes = all.begin();
  for (const ViewSummary& summary : views) {
    if (summary.kind != View::Kind::stripes) continue;
    StripeView view = *stripes++;
    view.camera_pixels.clear();
    view.coordinates_px.clear();
    for (std::size_t i = 0; i < summary.inlier.size(); ++i) {
      if (!summary.inlier[i]) continue;
      view.camera_pixels.push_back(std::prev(stripes)->camera_pixels[i]);
      view.coordinates_px.push_back(std::prev(stripes)->coordinates_px[i]);
    }
    if (!view.camera_pixels.empty()) kept.push_back(std::move(view));
  }
  return kept;
}

std::vector<LedView> telling_leds(const std::vector<LedView>& all, const std::vector<ViewSummary>& views) {
  std::vector<const ViewSummary*> summaries;
  for (const ViewSummary& summary : views) {
    if (summary.kind == View::Kind::leds) summaries.push_back(&summary);
  }
  std::map<std::size_t, LedCount> by_view, by_sensor, by_led;
  for (std::size_t v = 0; v < all.size(); ++v) {
    for (std::size_t i = 0; i < all[v].leds.size(); ++i) {
      for (LedCount* count : {&by_view[v], &by_sensor[all[v].sensor], &by_led[all[v].leds[i]]}) {
        ++count->read;
        count->left_out += summaries[v]->inlier[i] ? 0 : 1;
      }
    }
  }
  std::vector<LedView> kept;
  for (std::size_t v = 0; v < all.size(); ++v) {
    LedView view = all[v];
    view.leds.clear();
    view.pixels.clear();
    for (std::size_t i = 0; i < all[v].leds.size(); ++i) {
      const std::size_t led = all[v].leds[i];
      const bool changed = by_view[v].changed() || by_sensor[view.sensor].changed() || by_led[led].changed();
      if (!summaries[v]->inlier[i] && !changed) continue;
      view.leds.push_back(led);
      view.pixels.push_back(all[v].pixels[i]);
    }
    if (!view.leds.empty()) kept.push_back(std::move(view));
  }
  return kept;
}

}  // namespace crumple
