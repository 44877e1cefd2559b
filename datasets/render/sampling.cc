#include "datasets/render/sampling.h"

#include <array>
#include <cmath>
#include <numbers>

namespace crumple {
namespace {

constexpr int quantile_cells = 4096;
constexpr double sampled_reach = 4;

using DirectionNumbers = std::array<std::uint32_t, 32>;

// A dimension's primitive polynomial (degree, inner coefficients) and initial numbers; degree 0 is van der Corput's.
struct Dimension {
  std::uint32_t degree, coefficients;
  std::array<std::uint32_t, 4> initial;
};

constexpr std::array<Dimension, 6> dimensions{
    {{0, 0, {}}, {1, 0, {1}}, {2, 1, {1, 3}}, {3, 1, {1, 3, 1}}, {3, 2, {1, 1, 1}}, {4, 1, {1, 1, 3, 3}}}};

constexpr DirectionNumbers direction_numbers(const Dimension& dimension) {
  DirectionNumbers v{};
  const std::uint32_t degree = dimension.degree;
  for (std::uint32_t i = 0; i < 32; ++i) {
    if (degree == 0) {
      v[i] = 1U << (31 - i);
    } else if (i < degree) {
      v[i] = dimension.initial[i] << (31 - i);
    } else {
      v[i] = v[i - degree] ^ (v[i - degree] >> degree);
      for (std::uint32_t k = 1; k < degree; ++k) {
        if ((dimension.coefficients >> (degree - 1 - k)) & 1U) v[i] ^= v[i - k];
      }
    }
  }
  return v;
}

constexpr std::array<DirectionNumbers, 6> sobol{direction_numbers(dimensions[0]), direction_numbers(dimensions[1]),
                                                direction_numbers(dimensions[2]), direction_numbers(dimensions[3]),
                                                direction_numbers(dimensions[4]), direction_numbers(dimensions[5])};

std::uint32_t sobol_bits(std::uint32_t index, std::uint32_t dimension) {
  std::uint32_t bits = 0;
  for (std::size_t i = 0; index != 0; index >>= 1, ++i) {
    if (index & 1U) bits ^= sobol[dimension][i];
  }
  return bits;
}

double unit_from_bits(std::uint32_t bits) { return (bits + 0.5) * 0x1p-32; }

// The cumulative distribution of a unit box convolved with a Gaussian.
double footprint_cdf(double x, double blur) {
  if (blur <= 0) return std::fmin(1, std::fmax(0, x + 0.5));
  const auto integral = [](double t) {
    return t * 0.5 * std::erfc(-t / std::numbers::sqrt2) + std::exp(-t * t / 2) / std::sqrt(2 * std::numbers::pi);
  };
  return blur * (integral((x + 0.5) / blur) - integral((x - 0.5) / blur));
}

}  // namespace

std::uint64_t mix(std::uint64_t seed, std::uint64_t value) {
  // The finaliser of SplitMix64 (Steele, Lea, Flood 2014).
  std::uint64_t z = (seed ^ (value * 0xd1342543de82ef95ULL)) + 0x9e3779b97f4a7c15ULL;
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ULL;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebULL;
  return z ^ (z >> 31);
}

Eigen::Vector2d sample_point(std::uint32_t index, SampleUse use, std::uint64_t pixel_bits) {
  const auto pair = static_cast<std::uint32_t>(use);
  const std::uint32_t point = index / 2;
  const std::uint64_t scramble = mix(pixel_bits, pair);
  const Eigen::Vector2d unit{
      unit_from_bits(sobol_bits(point, 2 * pair) ^ static_cast<std::uint32_t>(scramble)),
      unit_from_bits(sobol_bits(point, 2 * pair + 1) ^ static_cast<std::uint32_t>(scramble >> 32))};
  const bool mirrored = index % 2 == 1;
  return mirrored ? Eigen::Vector2d(Eigen::Vector2d::Ones() - unit) : unit;
}

Eigen::Vector2d on_disc(const Eigen::Vector2d& unit) {
  const Eigen::Vector2d p = 2 * unit - Eigen::Vector2d::Ones();
  if (p.isZero()) return p;
  if (std::abs(p.x()) > std::abs(p.y())) {
    const double angle = std::numbers::pi / 4 * p.y() / p.x();
    return p.x() * Eigen::Vector2d(std::cos(angle), std::sin(angle));
  }
  const double angle = std::numbers::pi / 4 * p.x() / p.y();
  return p.y() * Eigen::Vector2d(std::sin(angle), std::cos(angle));
}

Footprint::Footprint(double blur_px) : quantiles_(quantile_cells + 1) {
  const double reach = 0.5 + sampled_reach * blur_px;
  for (int i = 0; i <= quantile_cells; ++i) {
    const double share = static_cast<double>(i) / quantile_cells;
    double low = -reach;
    double high = reach;
    for (int halving = 0; halving < 50; ++halving) {
      const double middle = (low + high) / 2;
      (footprint_cdf(middle, blur_px) < share ? low : high) = middle;
    }
    quantiles_[static_cast<std::size_t>(i)] = (low + high) / 2;
  }
}

double Footprint::offset_px(double unit) const {
  const double position = unit * quantile_cells;
  const auto cell = static_cast<std::size_t>(position);
  const double share = position - static_cast<double>(cell);
  return quantiles_[cell] + share * (quantiles_[cell + 1] - quantiles_[cell]);
}

}  // namespace crumple
