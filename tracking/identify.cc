#include "tracking/identify.h"

#include <algorithm>
#include <utility>

#include <Eigen/LU>
#include <fmt/format.h>

namespace crumple {
namespace {

struct Cluster {
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  std::vector<std::size_t> frames;  // ascending, each once
  std::vector<Spot> spots;

  Eigen::Vector2d middle() const { return sum / static_cast<double>(spots.size()); }
  void add(std::size_t frame, const Spot& spot) {
    sum += spot.pixel;
    frames.push_back(frame);
    spots.push_back(spot);
  }
};

// Each spot joins the nearest light within the radius that has none of this frame yet, or starts a new one.
std::vector<Cluster> clustered(const std::vector<std::optional<std::vector<Spot>>>& frames, double radius_px) {
  std::vector<Cluster> clusters;
  for (std::size_t frame = 0; frame < frames.size(); ++frame) {
    if (!frames[frame]) continue;
    for (const Spot& spot : *frames[frame]) {
      Cluster* nearest = nullptr;
      double least_px = radius_px;
      for (Cluster& cluster : clusters) {
        const double distance_px = (cluster.middle() - spot.pixel).norm();
        if (distance_px > least_px || cluster.frames.back() == frame) continue;
        least_px = distance_px;
        nearest = &cluster;
      }
      if (nearest == nullptr) nearest = &clusters.emplace_back();
      nearest->add(frame, spot);
    }
  }
  return clusters;
}

BlinkReading reading_of(const Cluster& cluster, const std::vector<std::optional<std::vector<Spot>>>& frames) {
  BlinkReading reading(frames.size(), BlinkState::missing);
  for (std::size_t frame = 0; frame < frames.size(); ++frame) {
    if (frames[frame]) reading[frame] = BlinkState::off;
  }
  for (const std::size_t frame : cluster.frames) reading[frame] = BlinkState::on;
  return reading;
}

Light light_of(const Cluster& cluster, double lasting_sigma_px) {
  Light light;
  Eigen::Matrix2d information = Eigen::Matrix2d::Zero();
  Eigen::Vector2d weighted = Eigen::Vector2d::Zero();
  for (const Spot& spot : cluster.spots) {
    const Eigen::Matrix2d weight = spot.covariance_px2.inverse();
    information += weight;
    weighted += weight * spot.pixel;
    light.centre_of_gravity_px += spot.centre_of_gravity_px / static_cast<double>(cluster.spots.size());
  }
  light.covariance_px2 = information.inverse();
  light.pixel = light.covariance_px2 * weighted;
  light.spots = static_cast<int>(cluster.spots.size());
  for (const Spot& spot : cluster.spots) {
    const Eigen::Vector2d off = spot.pixel - light.pixel;
    light.scatter_chi_square += off.dot(spot.covariance_px2.inverse() * off);
  }
  if (light.spots > 1) light.covariance_px2 *= std::max(1.0, light.scatter_chi_square / (2 * (light.spots - 1)));
  light.covariance_px2 += lasting_sigma_px * lasting_sigma_px * Eigen::Matrix2d::Identity();
  return light;
}

// The spots of each repetition of the words by themselves.
std::vector<LightTime> times_of(const Cluster& cluster, std::size_t word_length, double lasting_sigma_px) {
  std::vector<LightTime> times;
  for (std::size_t first = 0; first < cluster.frames.size();) {
    const std::size_t repetition = cluster.frames[first] / word_length;
    Cluster part;
    for (; first < cluster.frames.size() && cluster.frames[first] / word_length == repetition; ++first) {
      part.add(cluster.frames[first], cluster.spots[first]);
    }
    const Light light = light_of(part, lasting_sigma_px);
    times.push_back({repetition, light.pixel, light.covariance_px2});
  }
  return times;
}

// Two lights so near that spots may have gone to either.
bool crowded(const std::vector<Cluster>& clusters, std::size_t at, double radius_px) {
  for (std::size_t other = 0; other < clusters.size(); ++other) {
    // A single stray spot beside an LED takes nothing from it.
    if (other == at || clusters[other].spots.size() < 2) continue;
    if ((clusters[other].middle() - clusters[at].middle()).norm() < radius_px) return true;
  }
  return false;
}

void part_candidates(std::vector<IdentifiedLight>& told, Identification& result) {
  std::stable_sort(told.begin(), told.end(),
                   [](const IdentifiedLight& a, const IdentifiedLight& b) { return a.led < b.led; });
  for (std::size_t i = 0; i < told.size(); ++i) {
    const bool again =
        (i > 0 && told[i - 1].led == told[i].led) || (i + 1 < told.size() && told[i + 1].led == told[i].led);
    (again ? result.candidates : result.leds).push_back(told[i]);
  }
}

}  // namespace

Expected<Identification> identify_leds(const BlinkCode& code,
                                       const std::vector<std::optional<std::vector<Spot>>>& frames,
                                       const IdentifyOptions& options) {
  Identification result;
  for (const auto& frame : frames) result.frames += frame.has_value();
  if (frames.size() < static_cast<std::size_t>(code.length())) {
    return fail(fmt::format("{} frames, but a blink word has {}: record at least one whole word", frames.size(),
                            code.length()));
  }
  if (result.frames == 0) return fail("every frame of the sequence is missing");
  const std::vector<Cluster> clusters = clustered(frames, options.radius_px);
  std::vector<BlinkReading> readings;
  for (const Cluster& cluster : clusters) readings.push_back(reading_of(cluster, frames));
  const BlinkDecoding decoding = decode_blinks(code, readings);
  result.start_phase = decoding.start_phase;
  result.start_phase_told = decoding.start_phase_told;
  std::vector<IdentifiedLight> told;
  for (std::size_t i = 0; i < clusters.size(); ++i) {
    const BlinkDecoded& decoded = decoding.leds[i];
    Light light = light_of(clusters[i], options.lasting_sigma_px);
    light.times = times_of(clusters[i], static_cast<std::size_t>(code.length()), options.lasting_sigma_px);
    if (!decoded.led) {
      result.refused.push_back({light, words(decoded.refusal)});
    } else if (crowded(clusters, i, options.radius_px)) {
      result.refused.push_back({light, "another light is too near to tell whose spots are whose"});
    } else {
      told.push_back({*decoded.led, std::move(light), decoded.errors});
    }
  }
  part_candidates(told, result);
  return result;
}

}  // namespace crumple
