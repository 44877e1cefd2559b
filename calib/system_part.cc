#include "calib/system_part.h"

#include <algorithm>
#include <map>
#include <set>
#include <utility>

#include <fmt/format.h>

namespace crumple {
namespace {

std::string sighting_name(const CalibrationData& data, const BoardSighting& sighting) {
  const std::string& placement = data.placement_names[sighting.first];
  if (!sighting.second) return placement;
  const std::string& station = data.station_names[*sighting.second];
  return station == placement ? placement : fmt::format("{} from station {}", placement, station);
}

std::set<std::size_t> sensors_of(const CalibrationData& data, Mount mount) {
  std::set<std::size_t> sensors;
  for (std::size_t s = 0; s < data.sensors.size(); ++s) {
    if (data.sensors[s].mount == mount && !data.sensors[s].lens_of) sensors.insert(s);
  }
  return sensors;
}

// Sensors that sightings of the same board join, be it through others; by their first ones.
class JoinedSensors {
 public:
  JoinedSensors(const CalibrationData& data, Mount mount) {
    for (const std::size_t s : sensors_of(data, mount)) first_of_[s] = s;
    std::map<BoardSighting, std::size_t> seen_by;
    for (const CornerView& view : data.observations.corners) {
      if (!first_of_.contains(view.sensor)) continue;
      join(view.sensor, seen_by.emplace(BoardSighting{view.placement, view.station}, view.sensor).first->second);
    }
    for (const StripeView& view : data.observations.stripes) join(view.camera, view.projector);
    for (const FeatureView& view : data.observations.features) join(view.camera, view.projector);
  }

  std::map<std::size_t, std::set<std::size_t>> by_first() const {
    std::map<std::size_t, std::set<std::size_t>> joined;
    for (const auto& [sensor, first] : first_of_) joined[first].insert(sensor);
    return joined;
  }

 private:
  void join(std::size_t one, std::size_t other) {
    if (!first_of_.contains(one) || !first_of_.contains(other)) return;
    const auto [low, high] = std::minmax({first_of_.at(one), first_of_.at(other)});
    for (auto& [sensor, first] : first_of_) {
      if (first == high) first = low;
    }
  }

  std::map<std::size_t, std::size_t> first_of_;
};

class PartMaker {
 public:
  PartMaker(const CalibrationData& whole, const std::set<std::size_t>& sensors) : whole_(whole) {
    part_.data.boards = whole.boards;
    part_.data.temperature = whole.temperature;
    part_.data.may_be_open = whole.may_be_open;
    for (const std::size_t s : sensors) {
      number_of_sensor_[s] = part_.sensors.size();
      part_.sensors.push_back(s);
      part_.data.sensors.push_back(whole.sensors[s]);
      part_.data.sensors.back().mount = Mount::probe;
    }
  }

  SystemPart make() {
    for (CornerView view : whole_.observations.corners) {
      if (!number_of_sensor_.contains(view.sensor)) continue;
      view.sensor = number_of_sensor_.at(view.sensor);
      add(std::move(view), part_.data.observations.corners);
    }
    for (StripeView view : whole_.observations.stripes) {
      if (!take_pair(view)) continue;
      add(std::move(view), part_.data.observations.stripes);
    }
    for (FeatureView view : whole_.observations.features) {
      if (!take_pair(view)) continue;
      add(std::move(view), part_.data.observations.features);
    }
    for (PixelPairs pairs : whole_.pairs) {
      if (!take_pair(pairs)) continue;
      add(std::move(pairs), part_.data.pairs);
    }
    part_.data.observations.placement_count = part_.placements.size();
    return std::move(part_);
  }

 private:
  template <typename V>
  bool take_pair(V& view) const {
    if (!number_of_sensor_.contains(view.camera) || !number_of_sensor_.contains(view.projector)) return false;
    view.camera = number_of_sensor_.at(view.camera);
    view.projector = number_of_sensor_.at(view.projector);
    return true;
  }

  template <typename V>
  void add(V view, std::vector<V>& views) {
    view.placement = number_of({view.placement, view.station});
    view.station = std::nullopt;
    views.push_back(std::move(view));
  }

  std::size_t number_of(const BoardSighting& sighting) {
    const auto [found, is_new] = number_of_sighting_.emplace(sighting, part_.placements.size());
    if (is_new) {
      part_.placements.push_back(sighting);
      part_.data.board_of.push_back(whole_.board_of[sighting.first]);
      part_.data.placement_names.push_back(sighting_name(whole_, sighting));
    }
    return found->second;
  }

  const CalibrationData& whole_;
  SystemPart part_;
  std::map<std::size_t, std::size_t> number_of_sensor_;
  std::map<BoardSighting, std::size_t> number_of_sighting_;
};

}  // namespace

SystemPart system_part(const CalibrationData& whole, Mount mount) {
  return PartMaker(whole, sensors_of(whole, mount)).make();
}

std::vector<SystemPart> joined_parts(const CalibrationData& whole, Mount mount) {
  std::vector<SystemPart> parts;
  const auto joined = JoinedSensors(whole, mount).by_first();
  for (const auto& [first, sensors] : joined) parts.push_back(PartMaker(whole, sensors).make());
  return parts;
}

}  // namespace crumple
