#include "calib/accepted_observations.h"

#include <algorithm>
#include <cassert>
#include <utility>

namespace crumple {
namespace {

template <typename T>
void keep(const std::vector<char>& accepted, std::vector<T>& values) {
  assert(accepted.size() == values.size());
  std::vector<T> kept;
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (accepted[i]) kept.push_back(values[i]);
  }
  values = std::move(kept);
}

void keep(const std::vector<char>& accepted, CornerView& view) {
  keep(accepted, view.corners);
  keep(accepted, view.pixels);
}

void keep(const std::vector<char>& accepted, StripeView& view) {
  keep(accepted, view.camera_pixels);
  keep(accepted, view.coordinates_px);
}

void keep(const std::vector<char>& accepted, FeatureView& view) {
  keep(accepted, view.projector_pixels);
  keep(accepted, view.camera_pixels);
}

void keep(const std::vector<char>& accepted, LedView& view) {
  keep(accepted, view.leds);
  keep(accepted, view.pixels);
}

}  // namespace

Observations accepted_observations(const Observations& all, const std::vector<std::vector<char>>& accepted) {
  assert(all.overlaps.empty());
  Observations rest;
  rest.placement_count = all.placement_count;
  auto mask = accepted.begin();
  const auto take = [&](const auto& views, auto& kept) {
    for (auto view : views) {
      const bool any = std::any_of(mask->begin(), mask->end(), [](char c) { return c != 0; });
      keep(*mask++, view);
      if (any) kept.push_back(std::move(view));
    }
  };
  take(all.corners, rest.corners);
  take(all.stripes, rest.stripes);
  take(all.features, rest.features);
  take(all.leds, rest.leds);
  return rest;
}

}  // namespace crumple
