#include "calib/rig_prior.h"

#include <algorithm>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "solvers/parameters.h"

namespace crumple {
namespace {

const Led* find_led(const Rig& rig, const std::string& name) {
  const auto found = std::find_if(rig.leds.begin(), rig.leds.end(), [&](const Led& led) { return led.name == name; });
  return found == rig.leds.end() ? nullptr : &*found;
}

// The state with what the rig says of its sensors and LEDs.
Expected<CalibrationState> state_of_rig(const Rig& rig, CalibrationState state) {
  for (Sensor& sensor : state.rig.sensors) {
    const auto index = rig.find(sensor.name);
    if (!index) continue;
    const Sensor& known = rig.sensors[*index];
    if (known.lens.model() != sensor.lens.model() || known.mount != sensor.mount) {
      return fail(fmt::format("sensor {} has the lens {} and is {} here, but in the rig {} and {}", sensor.name,
                              sensor.lens.model(), sensor.mount == Mount::world ? "fixed to the world" : "on the probe",
                              known.lens.model(), known.mount == Mount::world ? "fixed to the world" : "on the probe"));
    }
    sensor.lens = known.lens;
    sensor.sensor_from_mount = known.sensor_from_mount;
  }
  for (Led& led : state.rig.leds) {
    if (const Led* known = find_led(rig, led.name)) led.position_mm = known->position_mm;
  }
  return state;
}

bool of_the_rig(const BlockId& block) {
  using Kind = BlockId::Kind;
  return block.kind == Kind::lens || block.kind == Kind::mount || block.kind == Kind::led || block.kind == Kind::scale;
}

std::set<BlockId> touched_blocks(const Observations& observations, const CalibrationState& state) {
  std::set<BlockId> touched;
  for (const auto& view : make_views(observations, state.board_of)) {
    for (const BlockId& block : view->blocks()) {
      if (of_the_rig(block)) touched.insert(block);
    }
  }
  return touched;
}

// The first sensor on a mount gives the mount its frame, so a refinement holds it; with a row in the covariance the rig
// would be in another frame.
Expected<void> check_frames(const CalibrationState& state, const std::map<std::string, int>& rows) {
  for (const Mount mount : {Mount::probe, Mount::world}) {
    const auto& sensors = state.rig.sensors;
    const auto first = std::find_if(sensors.begin(), sensors.end(), [&](const Sensor& s) { return s.mount == mount; });
    if (first == sensors.end() || !rows.contains(first->name + ".rotation_x")) continue;
    return fail(
        fmt::format("sensor {} is the first {}, but the rig's covariance is in another sensor's frame: give the "
                    "sensors in the rig's order",
                    first->name, mount == Mount::probe ? "on the probe" : "in the world"));
  }
  return {};
}

std::set<BlockId> stations_that_leds_fix(const CalibrationState& state, const Prior& prior,
                                         const std::set<BlockId>& touched) {
  const bool any_sensor = std::any_of(state.rig.sensors.begin(), state.rig.sensors.end(),
                                      [](const Sensor& sensor) { return sensor.mount == Mount::probe; });
  const bool any_led = std::any_of(prior.blocks().begin(), prior.blocks().end(), [&](const BlockId& block) {
    return block.kind == BlockId::Kind::led && touched.contains(block) &&
           state.rig.leds[block.index].mount == Mount::probe;
  });
  std::set<BlockId> freed;
  for (std::size_t s = 0; !any_sensor && any_led && s < state.world_from_probe.size(); ++s) {
    freed.insert({BlockId::Kind::station, s});
  }
  return freed;
}

}  // namespace

Expected<RigPrior> rig_prior(const Rig& rig, const CalibrationState& state, const Observations& observations,
                             const std::set<BlockId>& unknown, const std::set<BlockId>& carried) {
  if (rig.covariance.names.empty()) {
    return fail("the rig has no covariance, so nothing says how far it may be corrected: calibrate it anew");
  }
  auto about = state_of_rig(rig, state);
  if (!about) return tl::unexpected(about.error());
  std::map<std::string, int> row_of;
  for (const std::string& name : rig.covariance.names) row_of.emplace(name, static_cast<int>(row_of.size()));
  if (row_of.size() != rig.covariance.names.size()) return fail("the rig's covariance names a row twice");
  if (const auto sound = check_frames(*about, row_of); !sound) return tl::unexpected(sound.error());

  std::vector<PriorTerm> terms;
  std::vector<int> rows;
  std::set<BlockId> held;
  const std::set<BlockId> touched = touched_blocks(observations, *about);
  std::set<BlockId> blocks = touched;
  blocks.insert(carried.begin(), carried.end());
  for (const BlockId& block : blocks) {
    if (unknown.contains(block)) continue;
    const bool of_board = block.kind == BlockId::Kind::scale;
    const std::string& owner = of_board                           ? about->boards[block.index].name
                               : block.kind == BlockId::Kind::led ? about->rig.leds[block.index].name
                                                                  : about->rig.sensors[block.index].name;
    if (!of_board && !rig.find(owner) && find_led(rig, owner) == nullptr) continue;
    const std::vector<std::string> names = parameter_names(block, *about);
    const auto known = std::count_if(names.begin(), names.end(), [&](const auto& n) { return row_of.contains(n); });
    if (known == 0 && !of_board) held.insert(block);
    if (known > 0 && known < static_cast<std::ptrdiff_t>(names.size())) {
      return fail(fmt::format("the rig's covariance has some rows of {} and lacks others", owner));
    }
    for (std::size_t i = 0; known > 0 && i < names.size(); ++i) {
      terms.push_back({block, static_cast<int>(i)});
      rows.push_back(row_of.at(names[i]));
    }
  }
  const Eigen::MatrixXd covariance = rig.covariance.matrix(rows, rows);
  auto prior = Prior::create(kRigPrior, std::move(terms), *about, covariance);
  if (!prior) return tl::unexpected(prior.error());
  std::set<BlockId> freed = stations_that_leds_fix(*about, *prior, touched);
  return RigPrior{std::move(*about), std::move(*prior), std::move(held), std::move(freed)};
}

}  // namespace crumple
