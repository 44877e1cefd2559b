#include "datasets/render/sensor.h"

#include <algorithm>
#include <cmath>
#include <random>

#include "datasets/render/sampling.h"

namespace crumple {
namespace {

constexpr double normal_limit_electrons = 50;

class ElectronNoise {
 public:
  ElectronNoise(const Detector& detector, std::uint64_t seed) : detector_(detector), generator_(seed) {}

  double operator()(double mean_electrons) {
    const double read_variance = detector_.read_noise_electrons * detector_.read_noise_electrons;
    if (!detector_.shot_noise) return mean_electrons + std::sqrt(read_variance) * normal_(generator_);
    if (mean_electrons >= normal_limit_electrons) {
      return mean_electrons + std::sqrt(mean_electrons + read_variance) * normal_(generator_);
    }
    return poisson(mean_electrons) + std::sqrt(read_variance) * normal_(generator_);
  }

 private:
  // Knuth's multiplication method.
  double poisson(double mean) {
    const double stop = std::exp(-mean);
    int count = 0;
    for (double product = uniform_(generator_); product > stop; product *= uniform_(generator_)) ++count;
    return count;
  }

  const Detector& detector_;
  MixGenerator generator_;
  std::normal_distribution<double> normal_;
  std::uniform_real_distribution<double> uniform_;
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
    for (int x = 0; x < radiance.cols; ++x) {
      const double electrons =
          std::min(noise(electrons_per_radiance * static_cast<double>(radiance(y, x))), detector.full_well_electrons);
      const double step = std::clamp(std::round(detector.offset * steps + steps_per_electron * electrons), 0.0, steps);
      image.at<Code>(y, x) = static_cast<Code>(std::lround(spread * step));
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
