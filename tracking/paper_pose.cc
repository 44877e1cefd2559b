#include "tracking/paper_pose.h"

#include <cmath>
#include <map>

#include <fmt/format.h>

#include "solvers/closed_form/rigid_fit.h"
#include "solvers/closed_form/triangulate.h"

namespace crumple {

Expected<PaperPose> paper_pose(const Rig& rig, const LedReadings& readings) {
  const auto sightings = led_sightings(rig, readings);
  if (!sightings) return tl::unexpected(sightings.error());
  std::map<std::size_t, std::vector<Sighting>> of_led;
  for (const LedSighting& s : *sightings) {
    of_led[s.led].push_back({s.lens, s.sensor_from_world, s.pixel, s.covariance_px2});
  }
  PaperPose result;
  std::vector<Eigen::Vector3d> in_probe, in_world;
  for (const auto& [led, seen] : of_led) {
    const auto point = triangulate(seen);
    if (!point) continue;
    result.leds.push_back(led);
    in_probe.push_back(rig.leds[led].position_mm);
    in_world.push_back(point->point_mm);
  }
  if (in_probe.size() < 3) {
    return fail(
        fmt::format("two trackers share {} LEDs: the pose by triangulated markers needs three", in_probe.size()));
  }
  const auto pose = rigid_fit(in_probe, in_world);
  if (!pose) return tl::unexpected(pose.error());
  result.world_from_probe = *pose;
  for (std::size_t i = 0; i < in_probe.size(); ++i) {
    result.misfits_mm.push_back((in_world[i] - *pose * in_probe[i]).norm());
    result.rms_mm += result.misfits_mm.back() * result.misfits_mm.back() / static_cast<double>(in_probe.size());
  }
  result.rms_mm = std::sqrt(result.rms_mm);
  return result;
}

}  // namespace crumple
