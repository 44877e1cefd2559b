#include "solvers/dispensable_leds.h"

#include <algorithm>

namespace crumple {
namespace {

constexpr std::ptrdiff_t kFewestReadings = 2;

BlockId led_block(std::size_t led) { return {BlockId::Kind::led, led}; }

}  // namespace

DispensableLeds::DispensableLeds(const Observations& observations, const std::set<std::size_t>& dispensable,
                                 const std::set<BlockId>& held) {
  const std::size_t first = observations.corners.size() + observations.stripes.size() + observations.features.size();
  for (std::size_t v = 0; v < observations.leds.size(); ++v) {
    const std::vector<std::size_t>& leds = observations.leds[v].leds;
    for (std::size_t i = 0; i < leds.size(); ++i) {
      if (!dispensable.contains(leds[i]) || held.contains(led_block(leds[i]))) continue;
      readings_[leds[i]].emplace_back(first + v, i);
      all_.emplace(first + v, i);
    }
  }
}

bool DispensableLeds::reads(std::size_t view, int observation) const {
  return all_.contains({view, static_cast<std::size_t>(observation)});
}

bool DispensableLeds::settle(bool try_again, std::vector<ViewWeights>& weights, std::set<BlockId>& held) {
  bool changed = false;
  for (const auto& [led, readings] : readings_) {
    const auto accepted = std::count_if(readings.begin(), readings.end(),
                                        [&](const auto& r) { return weights[r.first].inlier[r.second] != 0; });
    const bool was_left_out = left_out_.contains(led);
    if (accepted >= kFewestReadings && !was_left_out) continue;
    if (accepted >= kFewestReadings && try_again) {
      left_out_.erase(led);
      held.erase(led_block(led));
      changed = true;
      continue;
    }
    for (const auto& [view, i] : readings) weights[view].inlier[i] = 0;
    if (was_left_out) continue;
    left_out_.insert(led);
    held.insert(led_block(led));
    changed = true;
  }
  return changed;
}

}  // namespace crumple
