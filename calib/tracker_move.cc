#include "calib/tracker_move.h"

#include <map>
#include <optional>
#include <set>
#include <string>

namespace crumple {

std::vector<Move> possible_moves(const CalibrationData& data) {
  std::map<std::size_t, std::set<std::size_t>> stations;
  for (const LedView& view : data.observations.leds) {
    if (view.station && data.sensors[view.sensor].mount == Mount::world) stations[view.sensor].insert(*view.station);
  }
  std::vector<Move> moves;
  for (const auto& [sensor, seen] : stations) {
    for (const std::size_t station : seen) {
      if (station != *seen.begin()) moves.push_back({sensor, station});
    }
  }
  return moves;
}

CalibrationData with_move(CalibrationData data, const Move& move) {
  const std::size_t later = data.sensors.size(), untold = later + 1;
  const auto reassign = [&](std::size_t& sensor, const std::optional<std::size_t>& station) {
    if (sensor != move.sensor || (station && *station < move.first_station)) return;
    sensor = station ? later : untold;
  };
  bool any_untold = false;
  for (CornerView& view : data.observations.corners) {
    reassign(view.sensor, std::nullopt);
    any_untold = any_untold || view.sensor == untold;
  }
  for (LedView& view : data.observations.leds) {
    reassign(view.sensor, view.station);
    any_untold = any_untold || view.sensor == untold;
  }
  SensorSpec moved = data.sensors[move.sensor];
  const std::string name = moved.name;
  if (!moved.lens_of) moved.lens_of = move.sensor;
  moved.name = name + " later";
  data.sensors.push_back(moved);
  moved.name = name + " untold";
  if (any_untold) data.sensors.push_back(moved);
  return data;
}

CalibrationData without_untimed(CalibrationData data, std::size_t sensor) {
  const auto untimed = [&](const auto& view) { return view.sensor == sensor && !view.station; };
  std::erase_if(data.observations.leds, untimed);
  std::erase_if(data.observations.corners, untimed);
  return data;
}

}  // namespace crumple
