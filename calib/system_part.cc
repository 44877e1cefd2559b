#include "calib/system_part.h"

#include <map>
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

class PartMaker {
 public:
  PartMaker(const CalibrationData& whole, Mount mount) : whole_(whole) {
    part_.data.boards = whole.boards;
    part_.data.temperature = whole.temperature;
    for (std::size_t s = 0; s < whole.sensors.size(); ++s) {
      if (whole.sensors[s].mount != mount || whole.sensors[s].lens_of) continue;
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

SystemPart system_part(const CalibrationData& whole, Mount mount) { return PartMaker(whole, mount).make(); }

}  // namespace crumple
