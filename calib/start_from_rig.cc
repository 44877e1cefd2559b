#include "calib/start_from_rig.h"

#include <algorithm>
#include <set>

#include <fmt/format.h>

#include "calib/known_system.h"
#include "calib/led_frame.h"
#include "solvers/closed_form/board_pose.h"

namespace crumple {
namespace {

// Sensors as the rig has them; those it lacks must be moves of others.
Expected<void> take_sensors(const CalibrationData& data, const Rig& rig, KnownSystem& known) {
  for (std::size_t s = 0; s < data.sensors.size(); ++s) {
    const SensorSpec& spec = data.sensors[s];
    Sensor& sensor = known.state.rig.sensors[s];
    const auto index = rig.find(spec.name);
    if (!index && spec.lens_of) {
      sensor.lens = known.state.rig.sensors[*spec.lens_of].lens;
      known.moved_trackers.insert(s);
      continue;
    }
    if (!index) {
      return fail(fmt::format("the rig has no sensor {}: leave it out with --sensors, or calibrate without the rig",
                              spec.name));
    }
    const Sensor& earlier = rig.sensors[*index];
    if (earlier.lens.model() != spec.lens_model || earlier.lens.size() != spec.size || earlier.mount != spec.mount ||
        earlier.kind != spec.kind) {
      return fail(fmt::format("sensor {} is another in the rig: a {} of {} x {} px with {}", spec.name,
                              earlier.kind == SensorKind::camera ? "camera" : "projector", earlier.lens.size().width_px,
                              earlier.lens.size().height_px, earlier.lens.model()));
    }
    sensor.lens = earlier.lens;
    sensor.sensor_from_mount = earlier.sensor_from_mount;
  }
  return {};
}

void take_leds(const CalibrationData& data, const Rig& rig, KnownSystem& known) {
  std::set<std::size_t> put_down_anew;
  for (const ScaleBar& bar : data.bars) {
    for (const auto& [from, to] : bar.places) put_down_anew.insert({from, to});
  }
  for (std::size_t l = 0; l < data.leds.size(); ++l) {
    const auto earlier = std::find_if(rig.leds.begin(), rig.leds.end(), [&](const Led& led) {
      return led.name == data.leds[l].name && led.mount == data.leds[l].mount;
    });
    if (earlier == rig.leds.end() || put_down_anew.contains(l)) continue;
    known.state.rig.leds[l].position_mm = earlier->position_mm;
    known.located.insert(l);
  }
}

// Every board by the camera that sees most of it; those that the probe's cameras see at a station, from there.
void pose_boards(const CalibrationData& data, KnownSystem& known) {
  std::map<BoardSighting, std::size_t> in_world, from_probe;  // points of the best view
  for (const CornerView& view : data.observations.corners) {
    if (known.moved_trackers.contains(view.sensor)) continue;
    const Sensor& sensor = known.state.rig.sensors[view.sensor];
    Points2d plane_mm, pixels;
    for (std::size_t i = 0; i < view.corners.size(); ++i) {
      const Eigen::Vector3d point = known.state.board_at(view.placement).point(view.corners[i]);
      plane_mm.push_back(point.head<2>());
      pixels.push_back(view.pixels[i]);
    }
    auto& seen = view.station ? from_probe : in_world;
    const BoardSighting sighting{view.placement, view.station};
    if (seen.contains(sighting) && seen[sighting] >= pixels.size()) continue;
    const auto sensor_from_board = board_pose(sensor.lens, plane_mm, pixels);
    if (!sensor_from_board) continue;
    seen[sighting] = pixels.size();
    const Pose mount_from_board = sensor.sensor_from_mount.inverse() * *sensor_from_board;
    if (view.station) {
      known.probe_from_board[sighting] = mount_from_board;
    } else {
      known.world_from_board[view.placement] = mount_from_board;
    }
  }
}

// Trackers alone, and of the LEDs that they read on the probe the rig has none.
bool probe_is_unknown(const CalibrationData& data, const KnownSystem& known) {
  const bool any_on_probe = std::any_of(data.sensors.begin(), data.sensors.end(),
                                        [](const SensorSpec& sensor) { return sensor.mount == Mount::probe; });
  std::set<std::size_t> read;
  for (const LedView& view : data.observations.leds) read.insert(view.leds.begin(), view.leds.end());
  bool any_led = false;
  for (const std::size_t l : read) {
    if (data.leds[l].mount != Mount::probe) continue;
    if (known.located.contains(l)) return false;
    any_led = true;
  }
  return any_led && !any_on_probe;
}

}  // namespace

Rig without_bars(Rig rig, const CalibrationData& data) {
  for (const ScaleBar& bar : data.bars) {
    for (const auto& ends : bar.places) {
      const std::string& from = data.leds[ends.first].name;
      const std::string& to = data.leds[ends.second].name;
      std::erase_if(rig.leds, [&](const Led& led) { return led.name == from || led.name == to; });
    }
  }
  return rig;
}

Expected<CalibrationState> start_from_rig(const CalibrationData& data, const Rig& rig,
                                          const std::map<std::string, double>& board_scales) {
  auto known = nothing_known(data);
  if (!known) return tl::unexpected(known.error());
  for (Board& board : known->state.boards) {
    if (const auto scale = board_scales.find(board.name); scale != board_scales.end()) board.scale = scale->second;
  }
  if (const auto taken = take_sensors(data, rig, *known); !taken) return tl::unexpected(taken.error());
  take_leds(data, rig, *known);
  pose_boards(data, *known);
  if (probe_is_unknown(data, *known)) {
    if (const auto built = build_constellation(data, *known); !built) return tl::unexpected(built.error());
    for (const auto& [led, point] : known->led_in_leds) {
      known->state.rig.leds[led].position_mm = point;
      known->located.insert(led);
    }
    known->world_from_probe = known->world_from_leds;
  }
  return settled(data, std::move(*known));
}

}  // namespace crumple
