#include "tracking/constellation.h"

#include <limits>

#include <Eigen/LU>
#include <fmt/format.h>

#include "tracking/mixed_images.h"
#include "tracking/paper_pose.h"
#include "tracking/swapped_leds.h"

namespace crumple {
namespace {

Expected<void> check_leds(const Rig& rig, const std::vector<TrackerLights>& trackers,
                          const std::vector<std::size_t>& led_of_word) {
  for (const TrackerLights& tracker : trackers) {
    for (const auto* lights : {&tracker.lights.leds, &tracker.lights.candidates}) {
      for (const IdentifiedLight& told : *lights) {
        if (told.led >= led_of_word.size()) return fail(fmt::format("word {} of the code is no LED's", told.led));
        const std::size_t led = led_of_word[told.led];
        if (led >= rig.leds.size()) return fail(fmt::format("a light is LED {}, which the rig has not", led));
      }
    }
  }
  return {};
}

Expected<void> check_images(const Rig& rig, const std::vector<TrackerLights>& trackers) {
  for (auto a = trackers.begin(); a != trackers.end(); ++a) {
    for (auto b = a + 1; b != trackers.end(); ++b) {
      if (!same_images(a->lights, b->lights)) continue;
      return fail(fmt::format("{} and {} have the same images: one of them has the other's",
                              rig.sensors[a->sensor].name, rig.sensors[b->sensor].name));
    }
  }
  return {};
}

// By one of a light's places: `pixel` or `centre_of_gravity_px`.
LedReadings undoubted_readings(const std::vector<TrackerLights>& trackers, const std::vector<std::size_t>& led_of_word,
                               Eigen::Vector2d Light::*place) {
  LedReadings readings;
  for (const TrackerLights& tracker : trackers) {
    LedReading reading{.view = {.sensor = tracker.sensor, .leds = {}, .pixels = {}}, .covariances_px2 = {}};
    for (const IdentifiedLight& told : tracker.lights.leds) {
      reading.view.leds.push_back(led_of_word[told.led]);
      reading.view.pixels.push_back(told.light.*place);
      reading.covariances_px2.push_back(told.light.covariance_px2);
    }
    readings.push_back(reading);
  }
  return readings;
}

// That words and images are those they are said to be, as far as that shows; `pose` is that of the readings with the
// same options.
Expected<void> check_names(const Rig& rig, const LedReadings& readings, const Expected<ProbePose>& pose,
                           const ProbePoseOptions& options) {
  if (const auto swapped = find_swapped_leds(rig, readings, pose, options)) {
    return fail(fmt::format("LEDs {} and {} seem swapped: each is where the other has to be; check their words",
                            rig.leds[swapped->first].name, rig.leds[swapped->second].name));
  }
  if (!pose) {
    if (const auto mixed = find_mixed_images(rig, readings, options)) return fail(*mixed);
  }
  return {};
}

// The squared difference to the predicted pixel over the variance of both.
double prediction_square(const Rig& rig, std::size_t sensor, std::size_t led, const Light& light,
                         const ProbePose& pose) {
  const Sensor& tracker = rig.sensors[sensor];
  const LedSighting sighting{.sensor = sensor,
                             .led = led,
                             .lens = &tracker.lens,
                             .sensor_from_world = tracker.sensor_from_mount,
                             .led_mm = rig.leds[led].position_mm,
                             .pixel = light.pixel,
                             .covariance_px2 = light.covariance_px2};
  SightingResidual at;
  if (!evaluate(sighting, pose.world_from_probe, at)) return std::numeric_limits<double>::infinity();
  const Eigen::Matrix2d variance = light.covariance_px2 + at.d_pose * pose.covariance * at.d_pose.transpose();
  return at.residual_px.dot(variance.inverse() * at.residual_px);
}

// Adds the one candidate of each word that agrees with the pose.
std::size_t take_candidates(const Rig& rig, const TrackerLights& tracker, const std::vector<std::size_t>& led_of_word,
                            const ProbePose& pose, double gate, LedReading& reading,
                            std::vector<RefusedLight>& refused) {
  const std::vector<IdentifiedLight>& candidates = tracker.lights.candidates;
  std::size_t taken = 0;
  for (std::size_t first = 0; first < candidates.size();) {
    std::size_t end = first;
    std::vector<std::size_t> agreeing;
    const std::size_t led = led_of_word[candidates[first].led];
    for (; end < candidates.size() && candidates[end].led == candidates[first].led; ++end) {
      if (prediction_square(rig, tracker.sensor, led, candidates[end].light, pose) < gate) agreeing.push_back(end);
    }
    for (std::size_t i = first; i < end; ++i) {
      if (agreeing.size() == 1 && agreeing.front() == i) {
        reading.view.leds.push_back(led);
        reading.view.pixels.push_back(candidates[i].light.pixel);
        reading.covariances_px2.push_back(candidates[i].light.covariance_px2);
        ++taken;
        continue;
      }
      refused.push_back({tracker.sensor, candidates[i].light,
                         fmt::format("blinks the word of LED {} as another light does, and {}", rig.leds[led].name,
                                     agreeing.size() > 1 ? "the pose agrees with both"
                                                         : "is not where the pose has it: a reflection")});
    }
    first = end;
  }
  return taken;
}

}  // namespace

std::vector<LedReadings> readings_over_time(const std::vector<TrackerLights>& trackers,
                                            const std::vector<std::size_t>& led_of_word) {
  std::vector<LedReadings> times;
  for (const TrackerLights& tracker : trackers) {
    for (const IdentifiedLight& light : tracker.lights.leds) {
      for (const LightTime& time : light.light.times) {
        if (times.size() <= time.repetition) times.resize(time.repetition + 1);
        LedReading reading{{tracker.sensor, {led_of_word[light.led]}, {time.pixel}, {}}, {time.covariance_px2}};
        times[time.repetition].push_back(std::move(reading));
      }
    }
  }
  return times;
}

Expected<Constellation> settle_constellation(const Rig& rig, const std::vector<TrackerLights>& trackers,
                                             const std::vector<std::size_t>& led_of_word,
                                             const ProbePoseOptions& options) {
  if (const auto known = check_leds(rig, trackers, led_of_word); !known) return tl::unexpected(known.error());
  if (const auto differ = check_images(rig, trackers); !differ) return tl::unexpected(differ.error());
  Constellation result;
  result.readings = undoubted_readings(trackers, led_of_word, &Light::pixel);
  auto pose = probe_pose(rig, result.readings, options);
  const auto right = check_names(rig, result.readings, pose, options);
  if (!right) return tl::unexpected(right.error());
  if (!pose) return tl::unexpected(pose.error());
  std::size_t taken = 0;
  for (std::size_t i = 0; i < trackers.size(); ++i) {
    for (const UnidentifiedLight& light : trackers[i].lights.refused) {
      result.refused.push_back({trackers[i].sensor, light.light, light.reason});
    }
    taken += take_candidates(rig, trackers[i], led_of_word, *pose, options.gate, result.readings[i], result.refused);
  }
  if (taken > 0) pose = probe_pose(rig, result.readings, options);
  if (!pose) return tl::unexpected(pose.error());
  result.pose = *pose;
  return result;
}

Expected<Constellation> settle_by_markers(const Rig& rig, const std::vector<TrackerLights>& trackers,
                                          const std::vector<std::size_t>& led_of_word, Eigen::Vector2d Light::*place) {
  if (const auto known = check_leds(rig, trackers, led_of_word); !known) return tl::unexpected(known.error());
  if (const auto differ = check_images(rig, trackers); !differ) return tl::unexpected(differ.error());
  const LedReadings by_spots = undoubted_readings(trackers, led_of_word, &Light::pixel);
  const auto right = check_names(rig, by_spots, probe_pose(rig, by_spots), {});
  if (!right) return tl::unexpected(right.error());
  Constellation result;
  result.readings = undoubted_readings(trackers, led_of_word, place);
  const auto pose = paper_pose(rig, result.readings);
  if (!pose) return tl::unexpected(pose.error());
  result.pose.world_from_probe = pose->world_from_probe;
  return result;
}

LedReadings used_readings(const Rig& rig, const Constellation& where) {
  LedReadings used;
  std::size_t residual = 0;
  for (const LedReading& reading : where.readings) {
    LedReading kept{{reading.view.sensor, {}, {}, reading.view.station}, {}};
    for (std::size_t i = 0; i < reading.view.leds.size(); ++i) {
      if (rig.leds[reading.view.leds[i]].mount != Mount::probe || !where.pose.residuals[residual++].used) continue;
      kept.view.leds.push_back(reading.view.leds[i]);
      kept.view.pixels.push_back(reading.view.pixels[i]);
      kept.covariances_px2.push_back(reading.covariances_px2[i]);
    }
    if (!kept.view.leds.empty()) used.push_back(std::move(kept));
  }
  return used;
}

}  // namespace crumple
