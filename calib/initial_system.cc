#include "calib/initial_system.h"

#include <algorithm>
#include <map>
#include <optional>
#include <set>
#include <utility>

#include <fmt/format.h>

#include "calib/known_system.h"
#include "calib/led_frame.h"
#include "calib/system_part.h"
#include "solvers/closed_form/hand_eye.h"
#include "solvers/mean_pose.h"
#include "tracking/motion_selection.h"

namespace crumple {
namespace {

Expected<void> take_part(const CalibrationData& data, Mount mount, const CalibratePart& calibrate_part,
                         KnownSystem& known) {
  const SystemPart part = system_part(data, mount);
  if (part.sensors.empty()) return {};
  const auto solved = calibrate_part(part.data);
  if (!solved) return tl::unexpected(solved.error());
  for (std::size_t s = 0; s < part.sensors.size(); ++s) {
    Sensor& sensor = known.state.rig.sensors[part.sensors[s]];
    sensor = solved->rig.sensors[s];
    sensor.mount = mount;
  }
  for (std::size_t p = 0; p < part.placements.size(); ++p) {
    const BoardSighting& sighting = part.placements[p];
    if (mount == Mount::world) {
      known.world_from_board[sighting.first] = solved->world_from_board[p];
    } else {
      known.probe_from_board[sighting] = solved->world_from_board[p];
    }
  }
  for (const std::size_t b : solved->board_of) known.state.boards[b] = solved->boards[b];
  return {};
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

}  // namespace

Expected<CalibrationState> initial_system(const CalibrationData& data, const CalibratePart& calibrate_part) {
  auto blank = nothing_known(data);
  if (!blank) return tl::unexpected(blank.error());
  KnownSystem known = std::move(*blank);
  if (const auto done = take_part(data, Mount::world, calibrate_part, known); !done)
    return tl::unexpected(done.error());
  if (const auto done = take_part(data, Mount::probe, calibrate_part, known); !done)
    return tl::unexpected(done.error());
  share_lenses(known);
  const bool any_led = std::any_of(data.observations.leds.begin(), data.observations.leds.end(),
                                   [](const LedView& view) { return view.station.has_value(); });
  if (any_led) {
    if (const auto done = build_constellation(data, known); !done) return tl::unexpected(done.error());
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
  }
  return settled(data, std::move(known));
}

}  // namespace crumple
