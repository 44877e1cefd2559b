#include "tracking/time_offset.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <vector>

#include <fmt/format.h>

namespace crumple {
namespace {

constexpr double kShortestWindow_s = 0.2;
constexpr double kWindowSteps = 4;  // of the sparser stream
constexpr double kMostSamples = 2e4;
constexpr double kSamplesPerWindow = 10;
constexpr double kLeastCorrelation = 0.5;
constexpr double kValley = 0.8;  // of the peak
constexpr double kRivalShare = 0.95;
constexpr double kFlat_rad = 2e-3;  // standard deviation of the signal, against rounding and jitter
constexpr int kOffsetRounds = 10;

struct Grid {
  double window_s;
  double step_s;
};

Grid grid_for(const PoseStream& a, const PoseStream& b) {
  const double window_s = std::max(kShortestWindow_s, kWindowSteps * std::max(a.median_step_s(), b.median_step_s()));
  const double longest_s = std::max(a.last_s() - a.first_s(), b.last_s() - b.first_s());
  return {window_s, std::max(window_s / kSamplesPerWindow, longest_s / kMostSamples)};
}

std::optional<double> turned(const PoseStream& stream, double time_s, double window_s) {
  const auto before = stream.at(time_s - 0.5 * window_s), after = stream.at(time_s + 0.5 * window_s);
  if (!before || !after) return std::nullopt;
  return rotation_vector(after->fixed_from_moving.rotation * before->fixed_from_moving.rotation.conjugate()).norm();
}

// NaN where the stream says nothing.
std::vector<double> signal_of(const PoseStream& stream, const Grid& grid) {
  std::vector<double> signal;
  for (int i = 0; stream.first_s() + i * grid.step_s <= stream.last_s(); ++i) {
    signal.push_back(turned(stream, stream.first_s() + i * grid.step_s, grid.window_s)
                         .value_or(std::numeric_limits<double>::quiet_NaN()));
  }
  return signal;
}

double deviation(const std::vector<double>& signal) {
  double n = 0, sum = 0, squares = 0;
  for (const double s : signal) {
    if (std::isnan(s)) continue;
    ++n;
    sum += s;
    squares += s * s;
  }
  return n > 1 ? std::sqrt(std::max(0.0, squares / n - sum * sum / (n * n))) : 0;
}

// Of a[i + shift] with b[i]; 0 where they overlap by fewer than `least` samples.
double correlation_at(const std::vector<double>& a, const std::vector<double>& b, std::ptrdiff_t shift, double least) {
  const auto first = std::max<std::ptrdiff_t>(0, -shift);
  const auto last = std::min(std::ssize(b), std::ssize(a) - shift);
  double n = 0, sa = 0, sb = 0, saa = 0, sbb = 0, sab = 0;
  for (std::ptrdiff_t i = first; i < last; ++i) {
    const double x = a[static_cast<std::size_t>(i + shift)], y = b[static_cast<std::size_t>(i)];
    if (std::isnan(x) || std::isnan(y)) continue;
    ++n;
    sa += x;
    sb += y;
    saa += x * x;
    sbb += y * y;
    sab += x * y;
  }
  if (n < least) return 0;
  const double variances = (saa - sa * sa / n) * (sbb - sb * sb / n);
  return variances > 0 ? (sab - sa * sb / n) / std::sqrt(variances) : 0;
}

struct Peak {
  std::ptrdiff_t shift = 0;
  double correlation = 0;
  double rival = 0;
};

std::ptrdiff_t usable(const std::vector<double>& signal) {
  return std::count_if(signal.begin(), signal.end(), [](double s) { return !std::isnan(s); });
}

// The rival is the best beyond the valley on either side of the peak.
Peak best_shift(const std::vector<double>& a, const std::vector<double>& b) {
  const double least = std::max(20.0, 0.5 * static_cast<double>(std::min(usable(a), usable(b))));
  std::vector<double> correlations;
  for (std::ptrdiff_t shift = -std::ssize(b); shift <= std::ssize(a); ++shift) {
    correlations.push_back(correlation_at(a, b, shift, least));
  }
  const auto best = std::max_element(correlations.begin(), correlations.end());
  auto low = best, high = best;
  while (low != correlations.begin() && *low > kValley * *best) --low;
  while (high + 1 != correlations.end() && *high > kValley * *best) ++high;
  const double left = *std::max_element(correlations.begin(), low + 1);
  const double right = *std::max_element(high, correlations.end());
  return {best - correlations.begin() - std::ssize(b), *best, std::max(left, right)};
}

// Gauss-Newton on the difference of the signals, b's samples against a interpolated.
TimeOffset refined(const PoseStream& a, const PoseStream& b, const Grid& grid, const std::vector<double>& signal,
                   double offset_s) {
  TimeOffset result;
  result.offset_s = offset_s;
  for (int round = 0; round < kOffsetRounds; ++round) {
    const double h = 0.5 * grid.step_s;
    double squares = 0, slope_squares = 0, product = 0, n = 0;
    for (std::size_t i = 0; i < signal.size(); ++i) {
      const double time_s = b.first_s() + static_cast<double>(i) * grid.step_s + result.offset_s;
      const auto before = turned(a, time_s - h, grid.window_s), after = turned(a, time_s + h, grid.window_s);
      if (std::isnan(signal[i]) || !before || !after) continue;
      const double slope = (*after - *before) / (2 * h), difference = 0.5 * (*before + *after) - signal[i];
      ++n;
      squares += difference * difference;
      slope_squares += slope * slope;
      product += slope * difference;
    }
    if (!(slope_squares > 0)) break;
    // A tenth of the samples is independent: the windows overlap.
    const double independent = std::max(2.0, n * grid.step_s / grid.window_s);
    result.sigma_s = std::sqrt(squares / slope_squares / (independent - 1));
    const double step_s = -product / slope_squares;
    result.offset_s += std::clamp(step_s, -grid.step_s, grid.step_s);
    if (std::abs(step_s) < 1e-3 * result.sigma_s) break;
  }
  return result;
}

}  // namespace

Expected<TimeOffset> estimate_time_offset(const PoseStream& a, const PoseStream& b) {
  const Grid grid = grid_for(a, b);
  const std::vector<double> of_a = signal_of(a, grid), of_b = signal_of(b, grid);
  for (const auto* signal : {&of_a, &of_b}) {
    if (!(deviation(*signal) > kFlat_rad)) {
      return fail(fmt::format(
          "the time offset cannot be told: the {} stream's angular rate does not vary; turn, stop and turn again",
          signal == &of_a ? "first" : "second"));
    }
  }
  const Peak peak = best_shift(of_a, of_b);
  if (!(peak.correlation > kLeastCorrelation)) {
    return fail(
        fmt::format("the time offset cannot be told: the streams' angular rates correlate by no more than "
                    "{:.2f} at any offset; are these two streams of one rigid body?",
                    peak.correlation));
  }
  if (peak.rival > kRivalShare * peak.correlation) {
    return fail(
        fmt::format("the time offset is ambiguous: the angular rates correlate by {:.3f} at the best offset and "
                    "by {:.3f} at another one; make the motion less regular",
                    peak.correlation, peak.rival));
  }
  TimeOffset result =
      refined(a, b, grid, of_b, a.first_s() - b.first_s() + static_cast<double>(peak.shift) * grid.step_s);
  result.correlation = peak.correlation;
  result.rival_correlation = peak.rival;
  return result;
}

}  // namespace crumple
