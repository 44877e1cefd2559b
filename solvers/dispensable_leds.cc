#include "solvers/dispensable_leds.h"

#include <algorithm>

namespace crumple {
namespace {

constexpr std::ptrdiff_t kFewestReadings = 2;

BlockId led_block(std::size_t led) { return {BlockId::Kind::led, led}; }

// By value, and not by distances from others only.
bool told(const BlockId& block, const std::vector<Prior>& priors) {
  return std::any_of(priors.begin(), priors.end(), [&](const Prior& prior) {
    return std::any_of(prior.terms().begin(), prior.terms().end(),
                       [&](const PriorTerm& term) { return term.block == block; });
  });
}

}  // namespace

DispensableLeds::DispensableLeds(const Observations& observations, const std::set<std::size_t>& dispensable,
                                 const std::set<BlockId>& held, const std::vector<Prior>& priors) {
  std::map<std::size_t, Readings> needed;
  const std::size_t first = observations.corners.size() + observations.stripes.size() + observations.features.size();
  for (std::size_t v = 0; v < observations.leds.size(); ++v) {
    const std::vector<std::size_t>& leds = observations.leds[v].leds;
    for (std::size_t i = 0; i < leds.size(); ++i) {
      if (held.contains(led_block(leds[i]))) continue;
      if (!dispensable.contains(leds[i])) {
        if (!told(led_block(leds[i]), priors)) needed[leds[i]].emplace_back(first + v, i);
        continue;
      }
      readings_[leds[i]].emplace_back(first + v, i);
      all_.emplace(first + v, i);
    }
  }
  for (auto& [led, readings] : needed) needed_.push_back(std::move(readings));
}

std::ptrdiff_t DispensableLeds::accepted(const Readings& readings, const std::vector<ViewWeights>& weights) {
  return std::count_if(readings.begin(), readings.end(),
                       [&](const auto& r) { return weights[r.first].inlier[r.second] != 0; });
}

void DispensableLeds::keep_needed(std::vector<ViewWeights>& weights) const {
  for (const Readings& readings : needed_) {
    if (accepted(readings, weights) >= kFewestReadings) continue;
    for (const auto& [view, i] : readings) weights[view].inlier[i] = 1;
  }
}

bool DispensableLeds::reads(std::size_t view, int observation) const {
  return all_.contains({view, static_cast<std::size_t>(observation)});
}

bool DispensableLeds::settle(bool try_again, std::vector<ViewWeights>& weights, std::set<BlockId>& held) {
  bool changed = false;
  for (const auto& [led, readings] : readings_) {
    const bool enough = accepted(readings, weights) >= kFewestReadings;
    const bool was_left_out = left_out_.contains(led);
    if (enough && !was_left_out) continue;
    if (enough && try_again) {
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
