#include "datasets/render/sampling.h"

#include <cmath>
#include <numbers>

namespace crumple {
namespace {

constexpr int quantile_cells = 4096;
constexpr double gaussian_reach = 4;

std::uint32_t reversed_bits(std::uint32_t bits) {
  bits = (bits << 16) | (bits >> 16);
  bits = ((bits & 0x00ff00ffU) << 8) | ((bits & 0xff00ff00U) >> 8);
  bits = ((bits & 0x0f0f0f0fU) << 4) | ((bits & 0xf0f0f0f0U) >> 4);
  bits = ((bits & 0x33333333U) << 2) | ((bits & 0xccccccccU) >> 2);
  return ((bits & 0x55555555U) << 1) | ((bits & 0xaaaaaaaaU) >> 1);
}

std::uint32_t sobol_second_dimension(std::uint32_t index) {
  std::uint32_t bits = 0;
  for (std::uint32_t direction = 1U << 31; index != 0; index >>= 1, direction ^= direction >> 1) {
    if (index & 1U) bits ^= direction;
  }
  return bits;
}

double unit_from_bits(std::uint32_t bits) { return (bits + 0.5) * 0x1p-32; }

// The cumulative distribution of a unit box convolved with a Gaussian.
double footprint_cdf(double x, double blur) {
  if (blur <= 0) return std::fmin(1, std::fmax(0, x + 0.5));
  const auto integral = [](double t) {
    return t * 0.5 * std::erfc(-t / std::numbers::sqrt2) +
           std::exp(-t * t / 2) / std::sqrt(2 * std::numbers::pi);
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

Eigen::Vector2d stratified_point(std::uint32_t index, std::uint64_t scramble) {
  const auto low = static_cast<std::uint32_t>(scramble);
  const auto high = static_cast<std::uint32_t>(scramble >> 32);
  return {unit_from_bits(reversed_bits(index) ^ low), unit_from_bits(sobol_second_dimension(index) ^ high)};
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
  const double reach = 0.5 + gaussian_reach * blur_px;
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
