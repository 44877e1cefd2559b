#include "datasets/render/sensor.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "datasets/render/sampling.h"

namespace crumple {
namespace {

constexpr double normal_limit_electrons = 50;

double normal_quantile(double share) {
  double low = -10;
  double high = 10;
  for (int halving = 0; halving < 60; ++halving) {
    const double middle = (low + high) / 2;
    (0.5 * std::erfc(-middle / std::numbers::sqrt2) < share ? low : high) = middle;
  }
  return (low + high) / 2;
}

// Normal numbers by the inverse distribution: from a table, but for the tails, which are computed.
class NormalTable {
 public:
  NormalTable() {
    for (std::size_t i = 0; i <= cells; ++i) quantiles_[i] = normal_quantile(static_cast<double>(i) / cells);
  }

  double operator()(double share) const {
    const double position = share * cells;
    const auto cell = static_cast<std::size_t>(position);
    if (cell < tail || cell >= cells - tail) return normal_quantile(share);
    return quantiles_[cell] + (position - static_cast<double>(cell)) * (quantiles_[cell + 1] - quantiles_[cell]);
  }

 private:
  static constexpr std::size_t cells = 8192;
  static constexpr std::size_t tail = 4;
  std::array<double, cells + 1> quantiles_{};
};

class ElectronNoise {
 public:
  ElectronNoise(const Detector& detector, std::uint64_t seed)
      : shot_noise_(detector.shot_noise),
        read_noise_(detector.read_noise_electrons),
        read_variance_(read_noise_ * read_noise_),
        generator_(seed) {}

  double operator()(double mean_electrons) {
    if (!shot_noise_) return mean_electrons + read_noise_ * normal();
    if (mean_electrons >= normal_limit_electrons) {
      return mean_electrons + std::sqrt(mean_electrons + read_variance_) * normal();
    }
    return poisson(mean_electrons) + read_noise_ * normal();
  }

 private:
  // In (0, 1), from the upper 53 bits.
  double uniform() { return (static_cast<double>(generator_() >> 11) + 0.5) * 0x1p-53; }

  double normal() {
    static const NormalTable table;
    return table(uniform());
  }

  // Knuth's multiplication method.
  double poisson(double mean) {
    const double stop = std::exp(-mean);
    int count = 0;
    for (double product = uniform(); product > stop; product *= uniform()) ++count;
    return count;
  }

  bool shot_noise_;
  double read_noise_;
  double read_variance_;
  MixGenerator generator_;
};

template <typename Code>
cv::Mat expose_to(const Detector& detector, const cv::Mat1f& radiance, std::uint64_t seed, int type) {
  cv::Mat image(radiance.size(), type);
  const double steps = (1 << detector.bits) - 1;
  const double spread = saturation_code(detector) / steps;
  const double electrons_per_radiance = detector.exposure * detector.full_well_electrons;
  const double steps_per_electron = steps * (1 - detector.offset) / detector.full_well_electrons;
  for (int y = 0; y < radiance.rows; ++y) {
    ElectronNoise noise(detector, mix(seed, static_cast<std::uint64_t>(y)));
    const float* light = radiance[y];
    Code* codes = image.ptr<Code>(y);
    for (int x = 0; x < radiance.cols; ++x) {
      const double electrons =
          std::min(noise(electrons_per_radiance * static_cast<double>(light[x])), detector.full_well_electrons);
      const double step = std::clamp(detector.offset * steps + steps_per_electron * electrons, 0.0, steps);
      codes[x] = static_cast<Code>(spread * std::floor(step + 0.5) + 0.5);
    }
  }
  return image;
}

}  // namespace

cv::Mat expose(const Detector& detector, const cv::Mat1f& radiance, std::uint64_t seed) {
  return detector.bits == 8 ? expose_to<std::uint8_t>(detector, radiance, seed, CV_8U)
                            : expose_to<std::uint16_t>(detector, radiance, seed, CV_16U);
}

double saturation_code(const Detector& detector) { return detector.bits == 8 ? 255 : 65535; }

double code_from_electrons(const Detector& detector, double electrons) {
  const double share = detector.offset + (1 - detector.offset) * electrons / detector.full_well_electrons;
  return saturation_code(detector) * share;
}

}  // namespace crumple
