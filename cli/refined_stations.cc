#include "cli/refined_stations.h"

#include <cmath>
#include <numbers>
#include <utility>

#include <fmt/format.h>

#include "cli/flags.h"
#include "cli/progress.h"
#include "datasets/station_pose.h"

namespace crumple {
namespace {

using nlohmann::json;

// The probe's LEDs that the pose was made of; what was left out there stays out.
LedReadings used_readings(const Rig& rig, const Constellation& where) {
  LedReadings used;
  std::size_t residual = 0;
  for (const LedReading& reading : where.readings) {
    LedReading kept{{reading.view.sensor, {}, {}, reading.view.station}, {}};
    for (std::size_t i = 0; i < reading.view.leds.size(); ++i) {
      if (rig.leds[reading.view.leds[i]].mount != Mount::probe || !where.pose.residuals[residual++].used) continue;
      kept.view.leds.push_back(reading.view.leds[i]);
      kept.view.pixels.push_back(reading.view.pixels[i]);
      kept.covariances_px2.push_back(reading.covariances_px2[i]);
    }
    if (!kept.view.leds.empty()) used.push_back(std::move(kept));
  }
  return used;
}

// No surface where the view cannot be reconstructed: the second pass says why.
std::vector<StationSurface> surfaces_of(const Capture& capture, const Rig& rig, const std::string& station,
                                        const std::vector<ScanningCamera>& cameras, StationOptions options) {
  options.estimator = Estimator::weighted;
  options.name = "station " + station;
  std::vector<StationSurface> surfaces;
  for (const ScanningCamera& camera : cameras) {
    const bool lit = rig.find(capture.projector_at(station)) == camera.projector_index;
    if (!lit || capture.exclusion(station, camera.camera)) continue;
    const auto images = read_stripe_images(capture, camera.camera, station);
    if (!images) continue;
    const auto readings = read_stripes(*images, options);
    if (!readings) continue;
    const auto cloud = reconstruct_readings(*camera.geometry, *readings, options);
    const auto best = cloud ? best_orientation(cloud->orientations) : std::nullopt;
    if (!best) continue;
    surfaces.push_back(
        {camera.camera_index, camera.projector_index, readings->orientations[*best].normal(),
         surface_patches(*camera.geometry, readings->orientations[*best], readings->coordinates[*best])});
  }
  return surfaces;
}

double degrees(double angle_rad) { return angle_rad * 180 / std::numbers::pi; }

json summary_of(const StationRefinement& refined, const std::vector<ObservedStation>& observed) {
  json result{{"overlaps", refined.overlaps},
              {"pairs", refined.pairs},
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
  std::string text =
      fmt::format("stations refined by {} overlaps; the LEDs' squares grew by {:.1f}, about {} are to be expected\n",
                  refined.overlaps, refined.contradiction_square, refined.contradiction_freedom);
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
                                           const std::vector<ScanningCamera>& cameras, const StationOptions& options) {
  std::vector<ObservedStation> observed;
  RefinedStations result;
  {
    Progress progress("reading what stations share", stations.size());
    for (const std::string& station : stations) {
      const auto where = station_pose(capture, rig, station);
      progress.advance();
      if (!where) continue;
      observed.push_back({.name = station,
                          .world_from_probe = where->constellation.pose.world_from_probe,
                          .readings = used_readings(rig, where->constellation),
                          .surfaces = surfaces_of(capture, rig, station, cameras, options)});
      result.poses.emplace(station, *where);
    }
  }
  const auto refined = refine_stations(rig, observed, {}, {.threads = thread_count()});
  if (!refined) return tl::unexpected(refined.error());
  for (std::size_t s = 0; s < observed.size(); ++s) {
    ProbePose& pose = result.poses.at(observed[s].name).constellation.pose;
    pose.world_from_probe = refined->stations[s].world_from_probe;
    pose.covariance = refined->stations[s].covariance;
  }
  result.summary = summary_of(*refined, observed);
  result.text = text_of(*refined, observed);
  return result;
}

}  // namespace crumple
