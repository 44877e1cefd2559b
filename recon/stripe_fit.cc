#include "recon/stripe_fit.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace crumple {
namespace {

// Below this the model's own interpolation is coarser than the step.
constexpr double kConverged = 1e-4;
constexpr double kLongestStep = 0.3;
constexpr double kGridStep = 0.5;
constexpr int kFitIterations = 12;
// Beyond the panel there is no signal at all; keeps the gain finite there.
constexpr float kNoSignal = 1e-12F;

// The grid point of least squares, the gain eliminated: sum D^2 - (sum v D)^2 / sum v^2.
double best_on_grid(const StripeTable& table, const BitVector& offsets, const BitVector& d, double start,
                    double reach) {
  const int steps = static_cast<int>(std::round(reach / kGridStep));
  double best = start;
  float most_explained = -std::numeric_limits<float>::infinity();
  for (int i = -steps; i <= steps; ++i) {
    const double u = start + i * kGridStep;
    const BitVector v = table.nearest(u) + offsets;
    const float vd = v.dot(d);
    // A negative gain is no explanation.
    const float explained = vd * std::abs(vd) / (v.squaredNorm() + kNoSignal);
    if (explained > most_explained) {
      most_explained = explained;
      best = u;
    }
  }
  return best;
}

struct FitNormal {
  float slope_slope, slope_value, value_value;  // slope is already times the gain
  float slope_residual, value_residual;
  float gain, squares;

  float determinant() const { return slope_slope * value_value - slope_value * slope_value; }
};

FitNormal normal_equations(const StripeTable& table, const BitVector& offsets, const BitVector& d, double u) {
  const StripeTable::Sample sample = table.at(u);
  const BitVector v = sample.value + offsets;
  const float vv = v.squaredNorm() + kNoSignal;
  const float gain = v.dot(d) / vv;
  const BitVector slope = gain * sample.slope;
  const BitVector residual = d - gain * v;
  return {.slope_slope = slope.squaredNorm(),
          .slope_value = slope.dot(v),
          .value_value = vv,
          .slope_residual = slope.dot(residual),
          .value_residual = v.dot(residual),
          .gain = gain,
          .squares = residual.squaredNorm()};
}

}  // namespace

StripeFit fit_stripe(const StripeTable& table, const BitVector& offsets, const BitVector& differences, double start,
                     double reach) {
  double u = reach > 0 ? best_on_grid(table, offsets, differences, start, reach) : start;
  FitNormal n = normal_equations(table, offsets, differences, u);
  for (int i = 0; i < kFitIterations && n.determinant() > 0; ++i) {
    const double step = (n.value_value * n.slope_residual - n.slope_value * n.value_residual) / n.determinant();
    u += std::clamp(step, -kLongestStep, kLongestStep);
    n = normal_equations(table, offsets, differences, u);
    if (std::abs(step) < kConverged) break;
  }
  StripeFit fit{.u = u, .gain = n.gain, .squares = n.squares};
  if (n.gain > 0 && n.determinant() > 0) fit.information = n.determinant() / n.value_value;
  return fit;
}

double stripe_information(const StripeTable& table, const BitVector& offsets, double u, double gain) {
  const StripeTable::Sample sample = table.at(u);
  const BitVector v = sample.value + offsets;
  const float slope_value = sample.slope.dot(v);
  const float information = sample.slope.squaredNorm() - slope_value * slope_value / (v.squaredNorm() + kNoSignal);
  return gain * gain * double{std::max(information, 0.0F)};
}

}  // namespace crumple
