#include "calib/known_system.h"

#include <vector>

#include <fmt/format.h>

#include "calib/pose_tracker.h"
#include "solvers/closed_form/triangulate.h"
#include "solvers/mean_pose.h"
#include "tracking/probe_pose.h"

namespace crumple {
namespace {

// Stations that are not known yet, by the pixels of LEDs that are: such as those of one tracker.
void pose_by_leds(const CalibrationData& data, KnownSystem& known) {
  constexpr double kNominalSigma_px = 0.5;
  for (std::size_t s = 0; s < data.station_names.size(); ++s) {
    if (known.world_from_probe.contains(s)) continue;
    LedReadings readings;
    for (const LedView& view : data.observations.leds) {
      if (view.station != s || known.moved_trackers.contains(view.sensor)) continue;
      LedView of_located{view.sensor, {}, {}, view.station};
      for (std::size_t i = 0; i < view.leds.size(); ++i) {
        if (!known.located.contains(view.leds[i])) continue;
        of_located.leds.push_back(view.leds[i]);
        of_located.pixels.push_back(view.pixels[i]);
      }
      const Eigen::Matrix2d covariance = kNominalSigma_px * kNominalSigma_px * Eigen::Matrix2d::Identity();
      const std::size_t count = of_located.leds.size();
      readings.push_back({std::move(of_located), std::vector<Eigen::Matrix2d>(count, covariance)});
    }
    const auto pose = probe_pose(known.state.rig, readings);
    if (pose) known.world_from_probe[s] = pose->world_from_probe;
  }
}

// Placements from stations and stations from placements until nothing new is known.
void spread(KnownSystem& known) {
  for (bool any = true; any;) {
    any = false;
    std::map<std::size_t, std::vector<Pose>> placements;
    for (const auto& [sighting, probe_from_board] : known.probe_from_board) {
      if (!sighting.second) continue;
      const auto station = known.world_from_probe.find(*sighting.second);
      if (station != known.world_from_probe.end() && !known.world_from_board.contains(sighting.first)) {
        placements[sighting.first].push_back(station->second * probe_from_board);
      }
    }
    for (const auto& [placement, poses] : placements) {
      known.world_from_board[placement] = mean_pose(poses);
      any = true;
    }
    for (const auto& [sighting, probe_from_board] : known.probe_from_board) {
      const auto board = known.world_from_board.find(sighting.first);
      if (!sighting.second || board == known.world_from_board.end()) continue;
      any = known.world_from_probe.emplace(*sighting.second, board->second * probe_from_board.inverse()).second || any;
    }
  }
}

// Trackers of later set-ups: their lenses are known, their places follow from what they see of the world. Returns
// whether any was posed.
bool pose_moved_trackers(const CalibrationData& data, KnownSystem& known) {
  bool any = false;
  for (const std::size_t s : std::set<std::size_t>(known.moved_trackers)) {
    std::vector<Eigen::Vector3d> in_world_mm;
    std::vector<Eigen::Vector2d> pixels;
    const auto add = [&](const Eigen::Vector3d& point, const Eigen::Vector2d& pixel) {
      in_world_mm.push_back(point);
      pixels.push_back(pixel);
    };
    for (const LedView& view : data.observations.leds) {
      if (view.sensor != s || (view.station && !known.world_from_probe.contains(*view.station))) continue;
      for (std::size_t i = 0; i < view.leds.size(); ++i) {
        if (!known.located.contains(view.leds[i])) continue;
        const Eigen::Vector3d& position = known.state.rig.leds[view.leds[i]].position_mm;
        add(view.station ? known.world_from_probe.at(*view.station) * position : position, view.pixels[i]);
      }
    }
    for (const CornerView& view : data.observations.corners) {
      if (view.sensor != s || !known.world_from_board.contains(view.placement)) continue;
      const Board& board = known.state.board_at(view.placement);
      for (std::size_t i = 0; i < view.corners.size(); ++i) {
        add(known.world_from_board.at(view.placement) * board.point(view.corners[i]), view.pixels[i]);
      }
    }
    Sensor& sensor = known.state.rig.sensors[s];
    const auto pose = pose_tracker(sensor.lens, in_world_mm, pixels);
    if (!pose) continue;
    sensor.sensor_from_mount = *pose;
    known.moved_trackers.erase(s);
    any = true;
  }
  return any;
}

// LEDs of the probe that are in no constellation yet: seen by single trackers, but from several stations that are
// posed. Names one that stays unknown; the refinement must not start it from nowhere.
Expected<void> locate_other_leds(const CalibrationData& data, KnownSystem& known) {
  std::map<std::size_t, std::vector<Sighting>> sightings;  // the probe's frame in place of the world
  for (const LedView& view : data.observations.leds) {
    if (!view.station) continue;
    const auto station = known.world_from_probe.find(*view.station);
    const Sensor& sensor = known.state.rig.sensors[view.sensor];
    for (std::size_t i = 0; i < view.leds.size(); ++i) {
      if (known.located.contains(view.leds[i])) continue;
      auto& of_led = sightings[view.leds[i]];
      if (station == known.world_from_probe.end()) continue;
      of_led.push_back({&sensor.lens, sensor.sensor_from_mount * station->second, view.pixels[i]});
    }
  }
  for (const LedView& view : data.observations.leds) {
    for (const std::size_t led : view.leds) {
      if (view.station || known.located.contains(led)) continue;
      return fail(
          fmt::format("LED {}: its place in the room cannot be told: two trackers must see it, or one that is "
                      "moved from both its places",
                      data.leds[led].name));
    }
  }
  for (const auto& [led, seen] : sightings) {
    const auto point = triangulate(seen);
    if (!point) {
      return fail(
          fmt::format("LED {}: its place on the probe cannot be told: {}", data.leds[led].name, point.error().message));
    }
    known.state.rig.leds[led].position_mm = point->point_mm;
  }
  return {};
}

// Takes the poses into the state; names what is not connected.
Expected<void> take_poses(const CalibrationData& data, const KnownSystem& known, CalibrationState& state) {
  if (!known.moved_trackers.empty()) {
    return fail(
        fmt::format("tracker {}: nothing tells where it was moved to: it needs four reference LEDs in the room that "
                    "another set-up sees too, or LEDs of the probe while that looks at a board placement of another "
                    "set-up",
                    data.sensors[*known.moved_trackers.begin()].name));
  }
  for (const LedView& view : data.observations.leds) {
    if (view.station && !known.world_from_probe.contains(*view.station)) {
      return fail(
          fmt::format("station {}: the probe cannot be posed: it needs three LEDs seen by two trackers each, or a "
                      "board whose place is known from other stations",
                      data.station_names[*view.station]));
    }
  }
  for (std::size_t p = 0; p < state.world_from_board.size(); ++p) {
    const auto found = known.world_from_board.find(p);
    if (found == known.world_from_board.end()) {
      return fail(
          fmt::format("placement {}: nothing connects it with the rest: neither trackers nor a posed station see "
                      "the board there",
                      data.placement_names[p]));
    }
    state.world_from_board[p] = found->second;
  }
  for (const auto& [station, pose] : known.world_from_probe) state.world_from_probe[station] = pose;
  return {};
}

}  // namespace

Expected<KnownSystem> nothing_known(const CalibrationData& data) {
  KnownSystem known;
  CalibrationState& state = known.state;
  for (const SensorSpec& spec : data.sensors) {
    auto lens = Lens::undistorted(spec.lens_model, spec.size, spec.size.width_px, spec.size.width_px,
                                  {0.5 * (spec.size.width_px - 1), 0.5 * (spec.size.height_px - 1)});
    if (!lens) return fail(fmt::format("{}: {}", spec.name, lens.error().message));
    state.rig.sensors.push_back({spec.name, spec.kind, std::move(*lens), {}, spec.mount, spec.lens_of});
  }
  state.rig.leds = data.leds;
  state.boards = nominal_boards(data);
  state.board_of = data.board_of;
  state.world_from_board.resize(data.placement_names.size());
  state.world_from_probe.resize(data.station_names.size());
  return known;
}

void share_lenses(KnownSystem& known) {
  std::vector<Sensor>& sensors = known.state.rig.sensors;
  for (std::size_t s = 0; s < sensors.size(); ++s) {
    if (!sensors[s].lens_of) continue;
    sensors[s].lens = sensors[*sensors[s].lens_of].lens;
    known.moved_trackers.insert(s);
  }
}

std::map<std::size_t, Eigen::Vector3d> triangulated_leds(const CalibrationData& data, const KnownSystem& known,
                                                         std::optional<std::size_t> station) {
  std::map<std::size_t, std::vector<Sighting>> sightings;
  for (const LedView& view : data.observations.leds) {
    if (view.station != station || known.moved_trackers.contains(view.sensor)) continue;
    const Sensor& sensor = known.state.rig.sensors[view.sensor];
    for (std::size_t i = 0; i < view.leds.size(); ++i) {
      sightings[view.leds[i]].push_back({&sensor.lens, sensor.sensor_from_mount, view.pixels[i]});
    }
  }
  std::map<std::size_t, Eigen::Vector3d> points;
  for (const auto& [led, seen] : sightings) {
    if (const auto point = triangulate(seen)) points[led] = point->point_mm;
  }
  return points;
}

Expected<CalibrationState> settled(const CalibrationData& data, KnownSystem known) {
  do {
    for (const auto& [led, point] : triangulated_leds(data, known, std::nullopt)) {
      known.state.rig.leds[led].position_mm = point;
      known.located.insert(led);
    }
    spread(known);
    pose_by_leds(data, known);
    spread(known);
  } while (pose_moved_trackers(data, known));
  if (const auto done = locate_other_leds(data, known); !done) return tl::unexpected(done.error());
  CalibrationState state = std::move(known.state);
  if (const auto done = take_poses(data, known, state); !done) return tl::unexpected(done.error());
  return state;
}

}  // namespace crumple
