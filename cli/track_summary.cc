#include "cli/track_summary.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <fmt/format.h>

#include "cli/pose_choice.h"
#include "cli/pose_flags.h"
#include "cli/untested_stillness.h"
#include "datasets/pose_csv.h"

namespace crumple {
namespace {

using nlohmann::json;

std::size_t left_out(const ProbePose& pose) {
  return static_cast<std::size_t>(
      std::count_if(pose.residuals.begin(), pose.residuals.end(), [](const LedResidual& r) { return !r.used; }));
}

// Of a pose as a whole: the root of the covariance's trace.
double sigma_deg(const Matrix6d& covariance) {
  return std::sqrt(covariance.topLeftCorner<3, 3>().trace()) * 180 / std::numbers::pi;
}
double sigma_mm(const Matrix6d& covariance) { return std::sqrt(covariance.bottomRightCorner<3, 3>().trace()); }

// Null where there was nothing to compare.
json stillness_json(const Stillness& stillness) {
  if (!stillness.tested()) return nullptr;
  return {{"chi_square", stillness.chi_square},
          {"degrees", stillness.degrees},
          {"probability", stillness.probability},
          {"largest_px", stillness.largest_px}};
}

json pose_json(const Rig& rig, const TrackedStation& tracked, PoseMethod method) {
  const StationPose& station = *tracked.found;
  const Constellation& found = station.constellation;
  const Pose& pose = found.pose.world_from_probe;
  json result{{"quaternion_wxyz", {pose.rotation.w(), pose.rotation.x(), pose.rotation.y(), pose.rotation.z()}},
              {"translation_mm", {pose.translation.x(), pose.translation.y(), pose.translation.z()}},
              {"stillness", stillness_json(station.stillness)}};
  if (method == PoseMethod::markers) return result;
  result["sigma_deg"] = sigma_deg(found.pose.covariance);
  result["sigma_mm"] = sigma_mm(found.pose.covariance);
  result["rig_sigma_deg"] = tracked.by_rig ? json(sigma_deg(*tracked.by_rig)) : json();
  result["rig_sigma_mm"] = tracked.by_rig ? json(sigma_mm(*tracked.by_rig)) : json();
  result["chi_square"] = found.pose.chi_square;
  result["redundancy"] = found.pose.redundancy;
  result["left_out"] = json::array();
  result["refused_lights"] = json::array();
  if (found.pose.choice) result["choice"] = choice_json(*found.pose.choice);
  for (const LedResidual& residual : found.pose.residuals) {
    if (residual.used) continue;
    result["left_out"].push_back({{"led", rig.leds[residual.led].name},
                                  {"sensor", rig.sensors[residual.sensor].name},
                                  {"residual_px", {residual.residual_px.x(), residual.residual_px.y()}}});
  }
  for (const RefusedLight& light : found.refused) {
    result["refused_lights"].push_back({{"sensor", rig.sensors[light.sensor].name},
                                        {"pixel", {light.light.pixel.x(), light.light.pixel.y()}},
                                        {"reason", light.reason}});
  }
  return result;
}

}  // namespace

json track_summary(const Rig& rig, const std::vector<TrackedStation>& stations, PoseMethod method) {
  json summary{{"schema", "crumple-track-summary/1"}, {"stations", json::object()}, {"failed", json::array()}};
  if (method == PoseMethod::markers) summary["uncertainty"] = {{"lacks", kMarkersLack}};
  for (const TrackedStation& station : stations) {
    if (station.found) {
      summary["stations"][station.station] = pose_json(rig, station, method);
    } else {
      summary["failed"].push_back({{"id", station.station}, {"reason", station.found.error().message}});
    }
  }
  return summary;
}

std::string track_text(const std::vector<TrackedStation>& stations, PoseMethod method) {
  std::string text;
  std::vector<std::string> untested;
  for (const TrackedStation& station : stations) {
    if (!station.found) {
      text += fmt::format("failed: {}\n", station.found.error().message);
      continue;
    }
    if (!station.found->stillness.tested()) untested.push_back(station.station);
    if (method == PoseMethod::markers) {
      text += fmt::format("{}: posed by markers\n", station.station);
      continue;
    }
    const ProbePose& pose = station.found->constellation.pose;
    text += fmt::format("{}: {} readings, {} left out, chi-square {:.1f} of {}; sigma {:.3f} deg, {:.2f} mm by LEDs, ",
                        station.station, pose.residuals.size(), left_out(pose), pose.chi_square, pose.redundancy,
                        sigma_deg(pose.covariance), sigma_mm(pose.covariance));
    text += station.by_rig
                ? fmt::format("{:.3f} deg, {:.2f} mm by rig\n", sigma_deg(*station.by_rig), sigma_mm(*station.by_rig))
                : std::string("unknown by rig\n");
    if (pose.choice) text += fmt::format("  {}\n", choice_text(*pose.choice));
  }
  if (method == PoseMethod::markers) text += fmt::format("no uncertainty: {}\n", kMarkersLack);
  return text + untested_text(untested);
}

std::string poses_csv(const std::vector<TrackedStation>& stations, PoseMethod method) {
  const int rows = method == PoseMethod::markers ? 0 : 6;  // of the covariance
  std::string text = kStationPoseColumns;
  for (int i = 0; i < rows; ++i) {
    for (int k = i; k < 6; ++k) text += fmt::format(",c{}{}", i, k);
  }
  text += "\n";
  for (const TrackedStation& station : stations) {
    if (!station.found) continue;
    const Pose& pose = station.found->constellation.pose.world_from_probe;
    text +=
        fmt::format("{},{},{},{},{},{},{},{}", station.station, pose.translation.x(), pose.translation.y(),
                    pose.translation.z(), pose.rotation.x(), pose.rotation.y(), pose.rotation.z(), pose.rotation.w());
    for (int i = 0; i < rows; ++i) {
      for (int k = i; k < 6; ++k) text += fmt::format(",{}", station.found->constellation.pose.covariance(i, k));
    }
    text += "\n";
  }
  return text;
}

}  // namespace crumple
