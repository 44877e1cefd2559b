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
  return block.kind == BlockId::Kind::lens || block.kind == BlockId::Kind::mount || block.kind == BlockId::Kind::led;
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

}  // namespace

Expected<RigPrior> rig_prior(const Rig& rig, const CalibrationState& state, const Observations& observations) {
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
  for (const BlockId& block : touched_blocks(observations, *about)) {
    const std::string& owner =
        block.kind == BlockId::Kind::led ? about->rig.leds[block.index].name : about->rig.sensors[block.index].name;
    if (!rig.find(owner) && find_led(rig, owner) == nullptr) continue;
    const std::vector<std::string> names = parameter_names(block, *about);
    const auto known = std::count_if(names.begin(), names.end(), [&](const auto& n) { return row_of.contains(n); });
    if (known == 0) held.insert(block);
    if (known > 0 && known < static_cast<std::ptrdiff_t>(names.size())) {
      return fail(fmt::format("the rig's covariance has some rows of {} and lacks others", owner));
    }
    for (std::size_t i = 0; known > 0 && i < names.size(); ++i) {
      terms.push_back({block, static_cast<int>(i)});
      rows.push_back(row_of.at(names[i]));
    }
  }
  const Eigen::MatrixXd covariance = rig.covariance.matrix(rows, rows);
  auto prior = Prior::create("rig", std::move(terms), *about, covariance);
  if (!prior) return tl::unexpected(prior.error());
  return RigPrior{std::move(*about), std::move(*prior), std::move(held)};
}

}  // namespace crumple
