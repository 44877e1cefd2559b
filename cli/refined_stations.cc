#include "cli/refined_stations.h"

#include <cmath>
#include <numbers>
#include <set>
#include <utility>

#include <fmt/format.h>

#include "calib/detect_target.h"
#include "calib/room_targets.h"
#include "cli/flags.h"
#include "cli/progress.h"

namespace crumple {
namespace {

using nlohmann::json;

// No surface where the view cannot be reconstructed: the second pass says why.
std::vector<StationSurface> surfaces_of(const Capture& capture, const Rig& rig, const std::string& station,
                                        const std::vector<SensorPair>& pairs, StationOptions options) {
  options.estimator = Estimator::weighted;
  options.name = "station " + station;
  std::vector<StationSurface> surfaces;
  for (const SensorPair& pair : pairs) {
    if (pair.projector != capture.projector_at(station) || capture.exclusion(station, pair.camera)) continue;
    const auto images = read_stripe_images(capture, pair.camera, station);
    if (!images) continue;
    const auto readings = read_stripes(*images, options);
    if (!readings) continue;
    const auto cloud = reconstruct_readings(pair.geometry, *readings, options);
    const auto best = cloud ? best_orientation(cloud->orientations) : std::nullopt;
    if (!best) continue;
    surfaces.push_back({*rig.find(pair.camera), *rig.find(pair.projector), readings->orientations[*best].normal(),
                        surface_patches(pair.geometry, readings->orientations[*best], readings->coordinates[*best])});
  }
  return surfaces;
}

// Boards whose place other stations share, in the images of the cameras that scan. Where none is found there is none.
void look_for_boards(const Capture& capture, const Rig& rig, const std::string& id, std::size_t index,
                     const std::vector<SensorPair>& pairs, std::vector<BoardSight>& sights) {
  const Station& station = *capture.station(id);
  if (station.placement.empty()) return;
  std::set<std::string> seen_by;
  for (const SensorPair& pair : pairs) {
    if (capture.exclusion(id, pair.camera) || !seen_by.insert(pair.camera).second) continue;
    const auto image = read_board_image(capture, pair.camera, id);
    if (!image) continue;
    for (const std::size_t board : station.boards) {
      auto found = detect_target_among(*image, capture.boards[board].target, station.boards.size());
      if (!found) continue;
      sights.push_back({index, *rig.find(pair.camera), board, station.placement, std::move(found->corners),
                        std::move(found->pixels)});
    }
  }
}

double degrees(double angle_rad) { return angle_rad * 180 / std::numbers::pi; }

json summary_of(const StationRefinement& refined, const std::vector<ObservedStation>& observed) {
  json result{{"overlaps", refined.overlaps},
              {"pairs", refined.pairs},
              {"targets", refined.targets_used},
              {"targets_left_out", refined.targets.size() - refined.targets_used},
              {"led_squares_grown_by", refined.contradiction_square},
              {"freedom", refined.contradiction_freedom},
              {"stations", json::array()}};
  for (std::size_t s = 0; s < observed.size(); ++s) {
    const RefinedStation& station = refined.stations[s];
    result["stations"].push_back(
        {{"id", observed[s].name},
         {"overlaps", station.overlaps},
         {"moved_mm", station.shift.tail<3>().norm()},
         {"moved_deg", degrees(station.shift.head<3>().norm())},
         {"moved_sigmas", station.shift_sigmas},
         {"sigma_mm", std::sqrt(station.covariance.bottomRightCorner<3, 3>().trace())},
         {"sigma_deg", degrees(std::sqrt(station.covariance.topLeftCorner<3, 3>().trace()))},
         {"sigma_by_leds_mm", std::sqrt(station.covariance_by_leds.bottomRightCorner<3, 3>().trace())},
         {"sigma_by_leds_deg", degrees(std::sqrt(station.covariance_by_leds.topLeftCorner<3, 3>().trace()))}});
  }
  return result;
}

std::string text_of(const StationRefinement& refined, const std::vector<ObservedStation>& observed) {
  std::string text = fmt::format(
      "stations refined by {} overlaps and {} targets; the LEDs' squares grew by {:.1f}, about {} are to be expected\n",
      refined.overlaps, refined.targets_used, refined.contradiction_square, refined.contradiction_freedom);
  for (std::size_t s = 0; s < observed.size(); ++s) {
    const RefinedStation& station = refined.stations[s];
    text += fmt::format("  {} moved by {:.3f} mm and {:.4f} deg, {:.1f} sigmas of its LEDs alone\n", observed[s].name,
                        station.shift.tail<3>().norm(), degrees(station.shift.head<3>().norm()), station.shift_sigmas);
  }
  return text;
}

}  // namespace

Expected<RefinedStations> refined_stations(const Capture& capture, const Rig& rig,
                                           const std::vector<std::string>& stations,
                                           const std::vector<SensorPair>& pairs, const StationOptions& options,
                                           NearPoses near) {
  std::vector<ObservedStation> observed;
  std::vector<BoardSight> sights;
  std::vector<Pose> places;
  RefinedStations result;
  {
    Progress progress("reading what stations share", stations.size());
    for (const std::string& station : stations) {
      const auto where = near.pose(capture, rig, station);
      progress.advance();
      if (!where) continue;
      look_for_boards(capture, rig, station, observed.size(), pairs, sights);
      places.push_back(where->constellation.pose.world_from_probe);
      observed.push_back({.name = station,
                          .world_from_probe = places.back(),
                          .readings = used_readings(rig, where->constellation),
                          .surfaces = surfaces_of(capture, rig, station, pairs, options)});
      result.poses.emplace(station, *where);
    }
  }
  RoomTargets targets = room_targets(rig, places, capture.boards, sights);
  for (std::size_t s = 0; s < observed.size(); ++s) observed[s].targets = std::move(targets.readings[s]);
  const auto refined = refine_stations(rig, observed, targets.targets, {.threads = thread_count()});
  if (!refined) return tl::unexpected(refined.error());
  for (std::size_t s = 0; s < observed.size(); ++s) {
    ProbePose& pose = result.poses.at(observed[s].name).constellation.pose;
    pose.world_from_probe = refined->stations[s].world_from_probe;
    pose.covariance = refined->stations[s].covariance;
  }
  auto known = refined_knowledge(rig, observed, *refined);
  if (!known) return tl::unexpected(known.error());
  result.rig = rig;
  result.rig.covariance = std::move(known->covariance);
  result.known = std::move(known->poses);
  result.rig.sensors = refined->bundle.state.rig.sensors;
  for (std::size_t l = 0; l < rig.leds.size(); ++l) result.rig.leds[l] = refined->bundle.state.rig.leds[l];
  result.summary = summary_of(*refined, observed);
  result.text = text_of(*refined, observed);
  return result;
}

}  // namespace crumple
