#include "calib/led_frame.h"

#include <algorithm>
#include <vector>

#include "calib/one_tracker.h"
#include "solvers/closed_form/rigid_fit.h"

namespace crumple {
namespace {

constexpr std::size_t kLeastForRigidFit = 3;

// The pose of the LEDs' frame from those LEDs it knows already.
std::optional<Pose> fit_leds(const std::map<std::size_t, Eigen::Vector3d>& in_leds,
                             const std::map<std::size_t, Eigen::Vector3d>& in_world) {
  std::vector<Eigen::Vector3d> from, to;
  for (const auto& [led, point] : in_world) {
    const auto known = in_leds.find(led);
    if (known == in_leds.end()) continue;
    from.push_back(known->second);
    to.push_back(point);
  }
  if (from.size() < kLeastForRigidFit) return std::nullopt;
  const auto pose = rigid_fit(from, to);
  return pose ? std::optional(*pose) : std::nullopt;
}

// Where nothing can be triangulated: the tracker that reads most LEDs before one placement poses that placement, the
// stations before it and the LEDs.
Expected<void> start_from_one_tracker(const CalibrationData& data, KnownSystem& known) {
  std::map<std::pair<std::size_t, std::size_t>, std::vector<LedsBeforeBoard>> candidates;  // by placement and tracker
  for (const LedView& view : data.observations.leds) {
    if (known.moved_trackers.contains(view.sensor)) continue;
    for (const auto& [sighting, probe_from_board] : known.probe_from_board) {
      if (!view.station || sighting.second != view.station) continue;
      candidates[{sighting.first, view.sensor}].push_back({probe_from_board.inverse(), view.leds, view.pixels});
    }
  }
  const auto most = std::max_element(candidates.begin(), candidates.end(),
                                     [](const auto& a, const auto& b) { return a.second.size() < b.second.size(); });
  if (most == candidates.end()) return fail("no tracker sees the probe's LEDs while the probe sees a board");
  const auto& [placement, tracker] = most->first;
  const Sensor& sensor = known.state.rig.sensors[tracker];
  const auto start = one_tracker_start(sensor.lens, most->second);
  if (!start) return tl::unexpected(start.error());
  const Pose world_from_board = sensor.sensor_from_mount.inverse() * start->tracker_from_board;
  known.world_from_board[placement] = world_from_board;
  for (const auto& [sighting, probe_from_board] : known.probe_from_board) {
    if (sighting.first != placement || !sighting.second) continue;
    known.world_from_probe[*sighting.second] = world_from_board * probe_from_board.inverse();
  }
  for (const auto& [led, position_mm] : start->led_in_probe_mm) {
    known.state.rig.leds[led].position_mm = position_mm;
    known.located.insert(led);
  }
  return {};
}

}  // namespace

Expected<void> build_constellation(const CalibrationData& data, KnownSystem& known) {
  std::map<std::size_t, std::map<std::size_t, Eigen::Vector3d>> waiting;  // station -> LED -> in the world
  for (std::size_t s = 0; s < data.station_names.size(); ++s) {
    auto points = triangulated_leds(data, known, s);
    if (points.size() >= kLeastForRigidFit) waiting.emplace(s, std::move(points));
  }
  if (waiting.empty() && !known.probe_from_board.empty()) return start_from_one_tracker(data, known);
  if (waiting.empty()) {
    return fail(
        "at no station do two trackers see the same three LEDs, so that the LEDs' places cannot be measured; "
        "nominal_mm, "
        "which has no uncertainty, does not stand in for that: show the probe's LEDs to two calibrated trackers at "
        "once, or calibrate the probe's camera before boards with them (then one tracker is enough)");
  }
  const auto most = std::max_element(waiting.begin(), waiting.end(),
                                     [](const auto& a, const auto& b) { return a.second.size() < b.second.size(); });
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (const auto& [led, point] : most->second) middle += point / static_cast<double>(most->second.size());
  for (const auto& [led, point] : most->second) known.led_in_leds[led] = point - middle;
  for (bool any = true; any && !waiting.empty();) {
    any = false;
    for (auto station = waiting.begin(); station != waiting.end();) {
      const auto pose = fit_leds(known.led_in_leds, station->second);
      if (!pose) {
        ++station;
        continue;
      }
      known.world_from_leds[station->first] = *pose;
      for (const auto& [led, point] : station->second) known.led_in_leds.emplace(led, pose->inverse() * point);
      station = waiting.erase(station);
      any = true;
    }
  }
  return {};
}

}  // namespace crumple
