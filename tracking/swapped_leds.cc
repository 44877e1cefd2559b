#include "tracking/swapped_leds.h"

#include <algorithm>
#include <iterator>
#include <set>
#include <vector>

namespace crumple {
namespace {

// Three LEDs before one tracker fit in any order, a fourth by chance.
constexpr int kLeastRedundancy = 4;

std::set<std::size_t> doubted_leds(const Rig& rig, const LedReadings& readings, const Expected<ProbePose>& pose) {
  std::set<std::size_t> doubted;
  for (const LedReading& reading : readings) {
    for (const std::size_t led : reading.view.leds) {
      if (led < rig.leds.size() && rig.leds[led].mount == Mount::probe) doubted.insert(led);
    }
  }
  if (!pose) return doubted;
  for (const LedResidual& residual : pose->residuals) {
    if (residual.used) doubted.erase(residual.led);
  }
  return doubted;
}

LedReadings exchanged(LedReadings readings, std::size_t a, std::size_t b) {
  for (LedReading& reading : readings) {
    for (std::size_t& led : reading.view.leds) {
      if (led == a || led == b) led = a + b - led;
    }
  }
  return readings;
}

}  // namespace

std::optional<std::pair<std::size_t, std::size_t>> find_swapped_leds(const Rig& rig, const LedReadings& readings,
                                                                     const Expected<ProbePose>& pose,
                                                                     const ProbePoseOptions& options) {
  const std::set<std::size_t> doubted = doubted_leds(rig, readings, pose);
  std::optional<std::pair<std::size_t, std::size_t>> swapped;
  std::pair<std::ptrdiff_t, double> best;  // readings used; chi-square, negated
  for (auto a = doubted.begin(); a != doubted.end(); ++a) {
    for (auto b = std::next(a); b != doubted.end(); ++b) {
      const auto other = probe_pose(rig, exchanged(readings, *a, *b), options);
      if (!other || other->redundancy < kLeastRedundancy) continue;
      const std::vector<LedResidual>& residuals = other->residuals;
      const bool explains_both = std::none_of(residuals.begin(), residuals.end(), [&](const LedResidual& r) {
        return !r.used && (r.led == *a || r.led == *b);
      });
      if (!explains_both) continue;
      const auto used = std::count_if(residuals.begin(), residuals.end(), [](const LedResidual& r) { return r.used; });
      const std::pair<std::ptrdiff_t, double> quality{used, -other->chi_square};
      if (swapped && quality <= best) continue;
      best = quality;
      swapped = {*a, *b};
    }
  }
  return swapped;
}

}  // namespace crumple
