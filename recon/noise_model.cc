#include "recon/noise_model.h"

#include <algorithm>
#include <cmath>

namespace crumple {
namespace {

constexpr std::size_t kClasses = 8;
constexpr std::size_t kFewest = 100;  // samples per class
constexpr double kRounding = 2.0 / 12;

}  // namespace

NoiseModel::NoiseModel(std::vector<Sample> samples, double freedom) {
  // The median of a mean square against its mean (Wilson and Hilferty 1931).
  const double median_over_mean = std::pow(1 - 2 / (9 * freedom), 3);
  std::sort(samples.begin(), samples.end(),
            [](const Sample& a, const Sample& b) { return a.brightness < b.brightness; });
  const std::size_t classes = std::min(kClasses, (samples.size() + kFewest - 1) / kFewest);
  for (std::size_t c = 0; c < classes; ++c) {
    const auto first = samples.begin() + static_cast<std::ptrdiff_t>(c * samples.size() / classes);
    const auto last = samples.begin() + static_cast<std::ptrdiff_t>((c + 1) * samples.size() / classes);
    const auto middle = first + (last - first) / 2;
    const double brightness = middle->brightness;
    std::nth_element(first, middle, last,
                     [](const Sample& a, const Sample& b) { return a.mean_square < b.mean_square; });
    classes_.push_back({brightness, std::max(double{middle->mean_square} / median_over_mean, kRounding)});
  }
}

double NoiseModel::variance(double brightness) const {
  if (classes_.empty()) return kRounding;
  const auto above =
      std::find_if(classes_.begin(), classes_.end(), [&](const Class& c) { return c.brightness >= brightness; });
  if (above == classes_.begin()) return above->variance;
  if (above == classes_.end()) return classes_.back().variance;
  const auto below = std::prev(above);
  const double t = (brightness - below->brightness) / (above->brightness - below->brightness);
  return (1 - t) * below->variance + t * above->variance;
}

}  // namespace crumple
