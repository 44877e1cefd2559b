#include "recon/stripe_fit.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace crumple {
namespace {

// Below this the model's own interpolation is coarser than the step.
constexpr double kConverged = 1e-5;
constexpr double kLongestStep = 0.3;
constexpr double kGridStep = 0.25;
constexpr int kIterations = 12;

// The grid point of least squares, the gain eliminated: sum D^2 - (sum v D)^2 / sum v^2.
double best_on_grid(const StripeModel& model, std::span<const float> d, double start, double reach) {
  const int steps = static_cast<int>(std::round(reach / kGridStep));
  double best = start;
  double most_explained = -std::numeric_limits<double>::infinity();
  for (int i = -steps; i <= steps; ++i) {
    const double u = start + i * kGridStep;
    const float* table = model.table.nearest(u);
    double vv = 0;
    double vd = 0;
    for (std::size_t b = 0; b < d.size(); ++b) {
      const double v = table[b] + model.offsets[b];
      vv += v * v;
      vd += v * d[b];
    }
    const double explained = vd > 0 ? vd * vd / vv : -vd * vd / vv;  // a negative gain is no explanation
    if (explained > most_explained) {
      most_explained = explained;
      best = u;
    }
  }
  return best;
}

struct Normal {
  double slope_slope = 0, slope_value = 0, value_value = 0;  // slope is already times the gain
  double slope_residual = 0, value_residual = 0;
  double gain = 0, squares = 0;

  double determinant() const { return slope_slope * value_value - slope_value * slope_value; }
};

Normal normal_equations(const StripeModel& model, std::span<const float> d, double u) {
  const StripeTable::Sample sample = model.table.at(u);
  double vv = 0;
  double vd = 0;
  for (std::size_t b = 0; b < d.size(); ++b) {
    const double v = sample.value[b] + model.offsets[b];
    vv += v * v;
    vd += v * d[b];
  }
  Normal n;
  n.gain = vd / vv;
  for (std::size_t b = 0; b < d.size(); ++b) {
    const double v = sample.value[b] + model.offsets[b];
    const double slope = n.gain * sample.slope[b];
    const double residual = d[b] - n.gain * v;
    n.slope_slope += slope * slope;
    n.slope_value += slope * v;
    n.value_value += v * v;
    n.slope_residual += slope * residual;
    n.value_residual += v * residual;
    n.squares += residual * residual;
  }
  return n;
}

}  // namespace

StripeFit fit_stripe(const StripeModel& model, std::span<const float> differences, double start, double reach) {
  double u = reach > 0 ? best_on_grid(model, differences, start, reach) : start;
  Normal n = normal_equations(model, differences, u);
  for (int i = 0; i < kIterations; ++i) {
    const double determinant = n.determinant();
    if (!(determinant > 0)) break;
    const double step = (n.value_value * n.slope_residual - n.slope_value * n.value_residual) / determinant;
    u += std::clamp(step, -kLongestStep, kLongestStep);
    n = normal_equations(model, differences, u);
    if (std::abs(step) < kConverged) break;
  }
  StripeFit fit{.u = u, .gain = n.gain, .squares = n.squares};
  if (n.gain > 0 && n.determinant() > 0) fit.information = n.determinant() / n.value_value;
  return fit;
}

}  // namespace crumple
