#include "tests/solvers/noisy_observations.h"

#include <cassert>
#include <type_traits>

#include "solvers/residuals.h"

namespace crumple {
namespace {

// Calls change(sigma_px, values, count) for the coordinates of every observation.
template <typename Change>
void for_each_observation(const NoiseLevels& levels, Observations& observations, const Change& change) {
  for (CornerView& view : observations.corners) {
    for (Eigen::Vector2d& pixel : view.pixels) change(levels.corner_px, pixel.data(), 2);
  }
  for (StripeView& view : observations.stripes) {
    for (double& coordinate_px : view.coordinates_px) change(levels.stripe_px, &coordinate_px, 1);
  }
  for (FeatureView& view : observations.features) {
    for (Eigen::Vector2d& pixel : view.camera_pixels) change(levels.feature_px, pixel.data(), 2);
  }
  for (LedView& view : observations.leds) {
    for (Eigen::Vector2d& pixel : view.pixels) change(levels.led_px, pixel.data(), 2);
  }
}

}  // namespace

Observations predicted_observations(const CalibrationState& truth, const Observations& layout) {
  Observations predicted = layout;
  predicted.overlaps.clear();
  const Observations measured = predicted;
  const auto views = make_views(measured, truth.board_of);
  std::size_t v = 0;
  const auto add_residuals = [&](auto& values) {
    ViewEvaluation evaluation;
    const bool there = views[v++]->evaluate(truth, false, evaluation);
    assert(there);
    static_cast<void>(there);
    Eigen::Index row = 0;
    for (auto& value : values) {
      if constexpr (std::is_same_v<std::decay_t<decltype(value)>, double>) {
        value += evaluation.residuals[row++];
      } else {
        value += evaluation.residuals.segment<2>(row);
        row += 2;
      }
    }
  };
  for (CornerView& view : predicted.corners) add_residuals(view.pixels);
  for (StripeView& view : predicted.stripes) add_residuals(view.coordinates_px);
  for (FeatureView& view : predicted.features) add_residuals(view.camera_pixels);
  for (LedView& view : predicted.leds) add_residuals(view.pixels);
  return predicted;
}

void add_noise(const NoiseLevels& levels, std::mt19937_64& random, Observations& observations) {
  std::normal_distribution<double> normal;
  for_each_observation(levels, observations, [&](double sigma_px, double* values, int count) {
    for (int i = 0; i < count; ++i) values[i] += sigma_px * normal(random);
  });
}

void add_gross_errors(double share, const NoiseLevels& levels, std::mt19937_64& random, Observations& observations) {
  std::bernoulli_distribution is_gross(share), to_the_left(0.5);
  std::uniform_real_distribution<double> size(20, 200);
  for_each_observation(levels, observations, [&](double sigma_px, double* values, int count) {
    if (!is_gross(random)) return;
    for (int i = 0; i < count; ++i) values[i] += (to_the_left(random) ? -1 : 1) * size(random) * sigma_px;
  });
}

}  // namespace crumple
