#include "tracking/mixed_images.h"

#include <algorithm>
#include <cstddef>
#include <numbers>
#include <utility>
#include <vector>

#include <fmt/format.h>

namespace crumple {
namespace {

constexpr std::ptrdiff_t kChance = 2;     // LEDs at the same place to the last digit
constexpr int kLeastRedundancy = 4;       // three LEDs before one tracker fit anything, a fourth by chance
constexpr std::ptrdiff_t kOneLeftOf = 8;  // readings that are wrong by themselves

std::optional<Pose> agreed_pose(const Rig& rig, const LedReadings& readings, const ProbePoseOptions& options) {
  const auto pose = probe_pose(rig, readings, options);
  if (!pose || pose->redundancy < kLeastRedundancy) return {};
  const auto read = static_cast<std::ptrdiff_t>(pose->residuals.size());
  const auto left =
      std::count_if(pose->residuals.begin(), pose->residuals.end(), [](const LedResidual& r) { return !r.used; });
  if (kOneLeftOf * left > read) return {};
  return pose->world_from_probe;
}

std::optional<std::string> exchanged_trackers(const Rig& rig, const LedReadings& readings,
                                              const ProbePoseOptions& options) {
  for (std::size_t a = 0; a < readings.size(); ++a) {
    for (std::size_t b = a + 1; b < readings.size(); ++b) {
      LedReadings exchanged = readings;
      std::swap(exchanged[a].view.sensor, exchanged[b].view.sensor);
      if (!agreed_pose(rig, exchanged, options)) continue;
      return fmt::format("{} and {} seem to have each other's images", rig.sensors[readings[a].view.sensor].name,
                         rig.sensors[readings[b].view.sensor].name);
    }
  }
  return {};
}

std::optional<std::string> odd_tracker(const Rig& rig, const LedReadings& readings, const ProbePoseOptions& options) {
  std::vector<std::pair<std::size_t, Pose>> without;
  for (std::size_t t = 0; t < readings.size(); ++t) {
    LedReadings rest = readings;
    rest.erase(rest.begin() + static_cast<std::ptrdiff_t>(t));
    if (const auto pose = agreed_pose(rig, rest, options)) without.emplace_back(t, *pose);
  }
  const auto name = [&](std::size_t t) { return rig.sensors[readings[t].view.sensor].name; };
  if (readings.size() > 2 && without.size() == 1) {
    return fmt::format("the other trackers agree on a pose without {}: it has images of another station, or has moved",
                       name(without.front().first));
  }
  if (readings.size() == 2 && without.size() == 2) {
    const Vector6d apart = local_step(without[0].second, without[1].second);
    return fmt::format(
        "{} and {} tell poses {:.1f} mm and {:.2f} deg apart, each by itself: one of them has images of another "
        "station, or has moved",
        name(0), name(1), apart.tail<3>().norm(), apart.head<3>().norm() * 180 / std::numbers::pi);
  }
  return {};
}

}  // namespace

bool same_images(const Identification& one, const Identification& other) {
  std::ptrdiff_t same = 0;
  for (const IdentifiedLight& a : one.leds) {
    same += std::count_if(other.leds.begin(), other.leds.end(),
                          [&](const IdentifiedLight& b) { return a.led == b.led && a.light.pixel == b.light.pixel; });
  }
  return same >= kChance;
}

std::optional<std::string> find_mixed_images(const Rig& rig, const LedReadings& readings,
                                             const ProbePoseOptions& options) {
  LedReadings read = readings;
  std::erase_if(read, [](const LedReading& reading) { return reading.view.leds.empty(); });
  if (auto exchanged = exchanged_trackers(rig, read, options)) return exchanged;
  return odd_tracker(rig, read, options);
}

}  // namespace crumple
