#include "calib/initial_system.h"

#include <algorithm>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "calib/join_trackers.h"
#include "calib/known_system.h"
#include "calib/led_frame.h"
#include "calib/system_part.h"
#include "solvers/closed_form/hand_eye.h"
#include "solvers/mean_pose.h"
#include "tracking/motion_selection.h"

namespace crumple {
namespace {

// Calibrates a part and takes its sensors and boards. Where boards are in the part's frame.
Expected<std::map<BoardSighting, Pose>> take_part(const SystemPart& part, const CalibratePart& calibrate_part,
                                                  KnownSystem& known) {
  std::map<BoardSighting, Pose> frame_from_board;
  if (part.sensors.empty()) return frame_from_board;
  const auto solved = calibrate_part(part.data);
  if (!solved) return tl::unexpected(solved.error());
  for (std::size_t s = 0; s < part.sensors.size(); ++s) {
    Sensor& sensor = known.state.rig.sensors[part.sensors[s]];
    const Mount mount = sensor.mount;
    sensor = solved->rig.sensors[s];
    sensor.mount = mount;
  }
  for (std::size_t p = 0; p < part.placements.size(); ++p) {
    frame_from_board[part.placements[p]] = solved->world_from_board[p];
  }
  for (const std::size_t b : solved->board_of) known.state.boards[b] = solved->boards[b];
  return frame_from_board;
}

// The part that the others are joined to: of most trackers, then of most views of LEDs; the first of equal ones.
std::size_t main_part(const CalibrationData& data, const std::vector<SystemPart>& parts) {
  std::size_t best = 0;
  std::pair<std::size_t, std::ptrdiff_t> most{0, 0};
  for (std::size_t p = 0; p < parts.size(); ++p) {
    const auto& sensors = parts[p].sensors;
    const auto views = std::count_if(
        data.observations.leds.begin(), data.observations.leds.end(),
        [&](const LedView& view) { return std::find(sensors.begin(), sensors.end(), view.sensor) != sensors.end(); });
    const std::pair size{sensors.size(), views};
    if (!(size > most)) continue;
    best = p;
    most = size;
  }
  return best;
}

// The main part's trackers stand in the world then; the others are given back. The main part has the last word on
// boards.
Expected<std::vector<TrackerGroup>> take_trackers(const CalibrationData& data, const CalibratePart& calibrate_part,
                                                  KnownSystem& known) {
  const std::vector<SystemPart> parts = joined_parts(data, Mount::world);
  std::vector<TrackerGroup> apart;
  if (parts.empty()) return apart;
  const std::size_t joined_to = main_part(data, parts);
  for (std::size_t p = 0; p < parts.size(); ++p) {
    if (p == joined_to) continue;
    const auto frame_from_board = take_part(parts[p], calibrate_part, known);
    if (!frame_from_board) return tl::unexpected(frame_from_board.error());
    apart.push_back({parts[p].sensors, {}});
    for (const auto& [sighting, pose] : *frame_from_board) apart.back().frame_from_board[sighting.first] = pose;
    known.moved_trackers.insert(parts[p].sensors.begin(), parts[p].sensors.end());
  }
  const auto world_from_board = take_part(parts[joined_to], calibrate_part, known);
  if (!world_from_board) return tl::unexpected(world_from_board.error());
  for (const auto& [sighting, pose] : *world_from_board) known.world_from_board[sighting.first] = pose;
  return apart;
}

// leds_from_probe by boards that trackers and probe see at the same place.
std::vector<Pose> direct_hand_eyes(const KnownSystem& known) {
  std::vector<Pose> found;
  for (const auto& [sighting, probe_from_board] : known.probe_from_board) {
    const auto board = known.world_from_board.find(sighting.first);
    if (!sighting.second || board == known.world_from_board.end()) continue;
    const auto leds = known.world_from_leds.find(*sighting.second);
    if (leds == known.world_from_leds.end()) continue;
    found.push_back(leds->second.inverse() * board->second * probe_from_board.inverse());
  }
  return found;
}

Expected<Pose> leds_from_probe(const KnownSystem& known) {
  if (const std::vector<Pose> direct = direct_hand_eyes(known); !direct.empty()) return mean_pose(direct);
  std::map<std::size_t, std::vector<PosePair>> pairs;  // by placement
  for (const auto& [sighting, probe_from_board] : known.probe_from_board) {
    if (!sighting.second) continue;
    const auto leds = known.world_from_leds.find(*sighting.second);
    if (leds == known.world_from_leds.end()) continue;
    auto& of_placement = pairs[sighting.first];
    of_placement.push_back(
        {static_cast<double>(of_placement.size()), leds->second, probe_from_board.inverse(), {}, {}});
  }
  std::vector<HandEyeMotion> motions;
  for (const auto& [placement, of_placement] : pairs) {
    if (of_placement.size() < 2) continue;
    const SelectedMotions selected = select_motions(of_placement);
    motions.insert(motions.end(), selected.motions.begin(), selected.motions.end());
  }
  const auto start = hand_eye_start(motions);
  if (!start) {
    return fail(
        fmt::format("hand and eye: {}. Show the probe the same board placement from several stations, turned about "
                    "different axes, or "
                    "let the trackers see the board too",
                    start.error().message));
  }
  return start->hand_from_eye;
}

// LEDs on the probe, and the probe at the stations that show them.
Expected<void> locate_probe(const CalibrationData& data, KnownSystem& known) {
  const bool any_led = std::any_of(data.observations.leds.begin(), data.observations.leds.end(),
                                   [](const LedView& view) { return view.station.has_value(); });
  if (!any_led) return {};
  if (const auto done = build_constellation(data, known); !done) return done;
  const bool needs_hand_eye = !known.probe_from_board.empty() && !known.led_in_leds.empty();
  const auto hand_eye = needs_hand_eye ? leds_from_probe(known) : Expected<Pose>(Pose{});
  if (!hand_eye) return tl::unexpected(hand_eye.error());
  for (const auto& [station, world_from_leds] : known.world_from_leds) {
    known.world_from_probe[station] = world_from_leds * *hand_eye;
  }
  for (const auto& [led, point] : known.led_in_leds) {
    known.state.rig.leds[led].position_mm = hand_eye->inverse() * point;
    known.located.insert(led);
  }
  return {};
}

Error not_joined(const CalibrationData& data, const TrackerGroup& group, const std::string& reason) {
  std::vector<std::string> names;
  for (const std::size_t sensor : group.sensors) names.push_back(data.sensors[sensor].name);
  return {
      fmt::format("{}: no board placement is shared with the other trackers, and LEDs do not join them: {}. Show a "
                  "board to both at once, or let both read the same LEDs of the probe at several stations",
                  fmt::join(names, ", "), reason)};
}

// One tracker, and no boards before the probe: nothing tells how far away LEDs are.
bool nothing_tells_depth(const CalibrationData& data, const KnownSystem& known) {
  std::size_t posed = 0;
  for (std::size_t s = 0; s < data.sensors.size(); ++s) {
    if (data.sensors[s].mount == Mount::world && !known.moved_trackers.contains(s)) ++posed;
  }
  return posed == 1 && known.probe_from_board.empty();
}

// With the probe located and the trackers of `apart` joined by what it shows. Those that are joined locate more of it,
// and others are joined by that.
Expected<KnownSystem> with_probe(const CalibrationData& data, KnownSystem known, std::vector<TrackerGroup> apart) {
  for (;;) {
    KnownSystem located = known;
    const auto done = locate_probe(data, located);
    if (!done && apart.empty()) return tl::unexpected(done.error());
    if (!done) {
      return tl::unexpected(not_joined(data, apart.front(),
                                       nothing_tells_depth(data, known)
                                           ? "one tracker alone cannot tell where LEDs are, and no camera on the "
                                             "probe sees a board"
                                           : done.error().message));
    }
    std::vector<TrackerGroup> waiting;
    std::string reason;
    for (const TrackerGroup& group : apart) {
      const auto frame_from_world = pose_group(data, group, located);
      if (!frame_from_world) {
        if (waiting.empty()) reason = frame_from_world.error().message;
        waiting.push_back(group);
        continue;
      }
      join(group, *frame_from_world, known);
      join(group, *frame_from_world, located);
    }
    if (waiting.empty()) return located;
    if (waiting.size() == apart.size()) return tl::unexpected(not_joined(data, waiting.front(), reason));
    apart = std::move(waiting);
  }
}

// The world frame is the first tracker's, whichever the others were joined to.
void move_world_to_first_tracker(CalibrationState& state) {
  const auto first = std::find_if(state.rig.sensors.begin(), state.rig.sensors.end(),
                                  [](const Sensor& sensor) { return sensor.mount == Mount::world; });
  const Pose first_from_world = first->sensor_from_mount;
  for (Sensor& sensor : state.rig.sensors) {
    if (sensor.mount == Mount::world) sensor.sensor_from_mount = sensor.sensor_from_mount * first_from_world.inverse();
  }
  first->sensor_from_mount = Pose{};
  for (Led& led : state.rig.leds) {
    if (led.mount == Mount::world) led.position_mm = first_from_world * led.position_mm;
  }
  for (Pose& pose : state.world_from_board) pose = first_from_world * pose;
  for (Pose& pose : state.world_from_probe) pose = first_from_world * pose;
}

}  // namespace

Expected<CalibrationState> initial_system(const CalibrationData& data, const CalibratePart& calibrate_part) {
  auto blank = nothing_known(data);
  if (!blank) return tl::unexpected(blank.error());
  KnownSystem known = std::move(*blank);
  auto apart = take_trackers(data, calibrate_part, known);
  if (!apart) return tl::unexpected(apart.error());
  const bool any_apart = !apart->empty();
  auto probe_from_board = take_part(system_part(data, Mount::probe), calibrate_part, known);
  if (!probe_from_board) return tl::unexpected(probe_from_board.error());
  known.probe_from_board = std::move(*probe_from_board);
  share_lenses(known);
  auto located = with_probe(data, std::move(known), std::move(*apart));
  if (!located) return tl::unexpected(located.error());
  auto state = settled(data, std::move(*located));
  if (state && any_apart) move_world_to_first_tracker(*state);
  return state;
}

}  // namespace crumple
