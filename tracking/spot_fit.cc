#include "tracking/spot_fit.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <Eigen/Cholesky>
#include <fmt/format.h>

namespace crumple {
namespace {

using Vector5d = Eigen::Matrix<double, 5, 1>;
using Matrix5d = Eigen::Matrix<double, 5, 5>;

constexpr double kNarrowest_px = 0.2;
constexpr double kFarthest_px = 2;
constexpr int kMaxFitSteps = 40;
constexpr int kReweighted = 3;

// P, and its derivatives by the offset and by the width.
struct PixelShare {
  double share, d_offset, d_width;
};

PixelShare pixel_share(double offset, double width) {
  const double right = (offset + 0.5) / width, left = (offset - 0.5) / width;
  const double density_right = std::exp(-right * right / 2) / std::sqrt(2 * std::numbers::pi);
  const double density_left = std::exp(-left * left / 2) / std::sqrt(2 * std::numbers::pi);
  return {(std::erf(right / std::numbers::sqrt2) - std::erf(left / std::numbers::sqrt2)) / 2,
          (density_right - density_left) / width, -(density_right * right - density_left * left) / width};
}

SpotModel moved_spot(const SpotModel& model, const Vector5d& step) {
  return {model.centre_px + step.head<2>(), model.width_px + step[2], model.flux + step[3], model.background + step[4]};
}

struct SpotEquations {
  Matrix5d information = Matrix5d::Zero();
  Vector5d gradient = Vector5d::Zero();
  double chi_square = 0;
};

SpotEquations spot_equations(const std::vector<SpotSample>& samples, const std::vector<double>& weights,
                             const SpotModel& model) {
  SpotEquations sum;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const SpotLevel at = spot_level(model, samples[i].u, samples[i].v);
    const double residual = at.level - samples[i].level;
    sum.information += weights[i] * at.derivative.transpose() * at.derivative;
    sum.gradient += weights[i] * residual * at.derivative.transpose();
    sum.chi_square += weights[i] * residual * residual;
  }
  return sum;
}

std::vector<double> weights_at(const std::vector<SpotSample>& samples, const SpotModel& model,
                               const LevelNoise& noise) {
  std::vector<double> weights;
  for (const SpotSample& sample : samples) {
    const double light = std::max(0.0, spot_level(model, sample.u, sample.v).level);
    weights.push_back(1 / (noise.dark * noise.dark + noise.gain * light));
  }
  return weights;
}

bool sound_spot(const SpotModel& model, const SpotModel& start, double largest_width_px) {
  return model.width_px > kNarrowest_px && model.width_px < largest_width_px && model.flux > 0 &&
         (model.centre_px - start.centre_px).norm() < kFarthest_px;
}

}  // namespace

SpotLevel spot_level(const SpotModel& model, int u, int v) {
  const PixelShare x = pixel_share(u - model.centre_px.x(), model.width_px);
  const PixelShare y = pixel_share(v - model.centre_px.y(), model.width_px);
  SpotLevel result;
  result.level = model.background + model.flux * x.share * y.share;
  result.derivative << -model.flux * x.d_offset * y.share, -model.flux * x.share * y.d_offset,
      model.flux * (x.d_width * y.share + x.share * y.d_width), x.share * y.share, 1;
  return result;
}

Expected<SpotFit> fit_spot(const std::vector<SpotSample>& samples, const SpotModel& start, const LevelNoise& noise,
                           double largest_width_px) {
  if (samples.size() < 7) return fail(fmt::format("{} pixels that are not saturated, of 7", samples.size()));
  SpotModel model = start;
  std::vector<double> weights = weights_at(samples, model, noise);
  SpotEquations at = spot_equations(samples, weights, model);
  double damping = 1e-3;
  int accepted = 0;
  for (int step = 0; step < kMaxFitSteps; ++step) {
    Matrix5d damped = at.information;
    damped.diagonal() *= 1 + damping;
    const Vector5d move = -damped.ldlt().solve(at.gradient);
    const SpotModel next = moved_spot(model, move);
    if (!move.allFinite() || !sound_spot(next, start, largest_width_px)) {
      if (damping > 1e6) return fail("its light does not fall off like a spot's");
      damping *= 10;
      continue;
    }
    SpotEquations then = spot_equations(samples, weights, next);
    if (then.chi_square > at.chi_square) {
      damping *= 10;
      if (damping > 1e8) break;
      continue;
    }
    const double gained = at.chi_square - then.chi_square;
    model = next;
    damping = std::max(1e-9, damping / 10);
    if (++accepted <= kReweighted) {
      weights = weights_at(samples, model, noise);
      then = spot_equations(samples, weights, model);
    }
    at = then;
    if (accepted > kReweighted && gained < 1e-9 * (1 + at.chi_square)) break;
  }
  SpotFit fit{.model = model, .covariance_px2 = {}, .chi_square = at.chi_square};
  fit.redundancy = static_cast<int>(samples.size()) - 5;
  const Matrix5d covariance = at.information.ldlt().solve(Matrix5d::Identity());
  const double excess = std::max(1.0, fit.chi_square / fit.redundancy);
  fit.covariance_px2 = excess * covariance.topLeftCorner<2, 2>();
  if (!fit.covariance_px2.allFinite() || !(fit.covariance_px2.determinant() > 0)) {
    return fail("its pixels do not tell where its centre is");
  }
  return fit;
}

}  // namespace crumple
