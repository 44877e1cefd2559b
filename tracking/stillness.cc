#include "tracking/stillness.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include <Eigen/LU>
#include <fmt/format.h>

#include "solvers/distribution_tails.h"

namespace crumple {
namespace {

struct ReadPixel {
  Eigen::Vector2d pixel;
  Eigen::Matrix2d covariance_px2;
};

using PixelsOfLeds = std::map<std::pair<std::size_t, std::size_t>, std::vector<ReadPixel>>;

PixelsOfLeds pixels_of_leds(const std::vector<LedReadings>& times) {
  PixelsOfLeds result;
  for (const LedReadings& readings : times) {
    for (const LedReading& reading : readings) {
      for (std::size_t i = 0; i < reading.view.leds.size(); ++i) {
        result[{reading.view.sensor, reading.view.leds[i]}].push_back(
            {reading.view.pixels[i], reading.covariances_px2[i]});
      }
    }
  }
  return result;
}

Eigen::Vector2d mean_pixel(const std::vector<ReadPixel>& pixels) {
  Eigen::Matrix2d information = Eigen::Matrix2d::Zero();
  Eigen::Vector2d weighted = Eigen::Vector2d::Zero();
  for (const ReadPixel& p : pixels) {
    information += p.covariance_px2.inverse();
    weighted += p.covariance_px2.inverse() * p.pixel;
  }
  return information.inverse() * weighted;
}

}  // namespace

Stillness stillness(const std::vector<LedReadings>& times, double least_probability) {
  Stillness result;
  double squares_px2 = 0;
  int readings = 0;
  for (const auto& [key, pixels] : pixels_of_leds(times)) {
    if (pixels.size() < 2) continue;
    LedMotion motion{.sensor = key.first, .led = key.second, .readings = static_cast<int>(pixels.size())};
    const Eigen::Vector2d mean = mean_pixel(pixels);
    for (const ReadPixel& p : pixels) {
      const Eigen::Vector2d off = p.pixel - mean;
      motion.chi_square += off.dot(p.covariance_px2.inverse() * off);
      squares_px2 += off.squaredNorm();
      for (const ReadPixel& other : pixels) {
        motion.largest_px = std::max(motion.largest_px, (p.pixel - other.pixel).norm());
      }
    }
    readings += motion.readings;
    result.degrees += 2 * (motion.readings - 1);
    result.chi_square += motion.chi_square;
    result.largest_px = std::max(result.largest_px, motion.largest_px);
    result.leds.push_back(motion);
  }
  if (readings > 0) result.rms_px = std::sqrt(squares_px2 / readings);
  result.probability = chi_square_tail(result.chi_square, result.degrees);
  result.still = result.probability >= least_probability;
  return result;
}

std::vector<std::size_t> moved_stations(const std::vector<Stillness>& stations, double least_probability) {
  std::vector<double> per_degree;
  for (const Stillness& station : stations) {
    if (station.tested()) per_degree.push_back(station.chi_square / station.degrees);
  }
  std::sort(per_degree.begin(), per_degree.end());
  const double noise = per_degree.size() < 2 ? 1 : std::max(1.0, per_degree[(per_degree.size() - 1) / 2]);
  std::vector<std::size_t> moved;
  for (std::size_t s = 0; s < stations.size(); ++s) {
    if (!stations[s].tested()) continue;
    if (chi_square_tail(stations[s].chi_square / noise, stations[s].degrees) < least_probability) moved.push_back(s);
  }
  return moved;
}

std::string moved_text(const Stillness& moved) {
  return fmt::format(
      "the probe or a tracker moved by up to {:.2f} px between readings of the LEDs (chi-square {:.0f} of {}): take it "
      "again while everything stands still",
      moved.largest_px, moved.chi_square, moved.degrees);
}

}  // namespace crumple
