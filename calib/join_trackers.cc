#include "calib/join_trackers.h"

#include <optional>
#include <utility>

#include "calib/pose_tracker.h"

namespace crumple {
namespace {

using LedPlace = std::pair<std::optional<std::size_t>, std::size_t>;  // station, if it is the probe's, and LED

std::optional<Eigen::Vector3d> in_world(const LedPlace& place, const std::map<std::size_t, Eigen::Vector3d>& in_room,
                                        const KnownSystem& known) {
  const auto& [station, led] = place;
  if (!station) {
    const auto found = in_room.find(led);
    return found == in_room.end() ? std::nullopt : std::optional(found->second);
  }
  const auto pose = known.world_from_probe.find(*station);
  if (pose == known.world_from_probe.end() || !known.located.contains(led)) return std::nullopt;
  return pose->second * known.state.rig.leds[led].position_mm;
}

}  // namespace

Expected<Pose> pose_group(const CalibrationData& data, const TrackerGroup& group, const KnownSystem& known) {
  const std::map<std::size_t, Eigen::Vector3d> in_room = triangulated_leds(data, known, std::nullopt);
  std::vector<Sensor> trackers;
  std::map<LedPlace, std::size_t> number_of;
  std::vector<Eigen::Vector3d> points_mm;
  std::vector<LedView> seen;
  for (const std::size_t sensor : group.sensors) {
    LedView of_tracker{trackers.size(), {}, {}, {}};
    trackers.push_back(known.state.rig.sensors[sensor]);
    for (const LedView& view : data.observations.leds) {
      if (view.sensor != sensor) continue;
      for (std::size_t i = 0; i < view.leds.size(); ++i) {
        const LedPlace place{view.station, view.leds[i]};
        const auto point = in_world(place, in_room, known);
        if (!point) continue;
        const auto [number, is_new] = number_of.emplace(place, points_mm.size());
        if (is_new) points_mm.push_back(*point);
        of_tracker.leds.push_back(number->second);
        of_tracker.pixels.push_back(view.pixels[i]);
      }
    }
    seen.push_back(std::move(of_tracker));
  }
  return pose_trackers(trackers, points_mm, seen);
}

void join(const TrackerGroup& group, const Pose& frame_from_world, KnownSystem& known) {
  for (const std::size_t sensor : group.sensors) {
    Pose& mount = known.state.rig.sensors[sensor].sensor_from_mount;
    mount = mount * frame_from_world;
    known.moved_trackers.erase(sensor);
  }
  const Pose world_from_frame = frame_from_world.inverse();
  for (const auto& [placement, frame_from_board] : group.frame_from_board) {
    known.world_from_board[placement] = world_from_frame * frame_from_board;
  }
}

}  // namespace crumple
