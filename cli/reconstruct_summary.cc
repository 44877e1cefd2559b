#include "cli/reconstruct_summary.h"

#include <cmath>
#include <numbers>

#include <fmt/format.h>

#include "cli/pose_choice.h"
#include "cli/untested_stillness.h"

namespace crumple {
namespace {

using nlohmann::json;

json orientation_json(const OrientationReport& orientation) {
  json result{{"angle_deg", orientation.angle_rad * 180 / std::numbers::pi},
              {"decoded_fraction", orientation.decoded_fraction},
              {"median_sigma_px", orientation.median_sigma_px},
              {"sensitivity_px_per_mm", orientation.sensitivity_px_per_mm},
              {"used", orientation.used}};
  if (!orientation.used) result["reason"] = orientation.reason;
  return result;
}

json view_json(const ReconstructedView& view) {
  json result{{"id", view.station},
              {"camera", view.camera},
              {"estimator", view.estimator},
              {"points", view.points},
              {"decoded_fraction", view.decoded_fraction},
              {"median_sigma_mm", view.median_sigma_mm},
              {"removed",
               {{"isolated", view.removed.isolated},
                {"off_surface", view.removed.off_surface},
                {"grazing", view.removed.grazing},
                {"edge", view.removed.edge}}},
              {"orientations", json::array()}};
  for (const OrientationReport& orientation : view.orientations) {
    result["orientations"].push_back(orientation_json(orientation));
  }
  return result;
}

// By rig and poses, and what merging allows both sides as a whole; none where these are not known.
std::optional<double> offset_sigma_mm(const StationOverlap& overlap, const WrittenCloud& cloud) {
  const auto told = cloud.offset_sigmas_mm.find(overlap.view);
  if (told == cloud.offset_sigmas_mm.end()) return std::nullopt;
  return std::hypot(told->second, std::numbers::sqrt2 * MergeOptions().common_sigma_mm);
}

json merge_json(const WrittenCloud& cloud) {
  const MergeReport& report = *cloud.merged;
  json result{{"spacing_mm", report.spacing_mm},
              {"points_in", report.points_in},
              {"without_normal", report.without_normal},
              {"points", report.points_out},
              {"overlap_share", report.overlap_share},
              {"contradictions", report.contradictions},
              {"outvoted", report.outvoted},
              {"stations", json::array()}};
  for (const StationOverlap& overlap : report.stations) {
    const auto sigma_mm = offset_sigma_mm(overlap, cloud);
    result["stations"].push_back({{"id", overlap.station},
                                  {"points", overlap.points},
                                  {"shared_points", overlap.shared_points},
                                  {"shared_sites", overlap.shared_sites},
                                  {"offset_mm", overlap.offset_mm},
                                  {"offset_sigma_mm", sigma_mm ? json(*sigma_mm) : json()},
                                  {"difference_mm", overlap.difference_mm},
                                  {"split", overlap.split}});
  }
  return result;
}

std::string merge_text(const WrittenCloud& cloud) {
  std::string text = fmt::format(
      "{}: {} points merged into {}, {:.2f} mm apart, {:.1f} % of them seen by several stations; {} contradict each "
      "other, {} were outvoted\n",
      cloud.estimator, cloud.merged->points_in, cloud.points, cloud.merged->spacing_mm,
      100 * cloud.merged->overlap_share, cloud.merged->contradictions, cloud.merged->outvoted);
  for (const StationOverlap& overlap : cloud.merged->stations) {
    if (overlap.shared_sites == 0) continue;
    const auto sigma_mm = offset_sigma_mm(overlap, cloud);
    text += fmt::format("  {} differs from those before it by {:.3f} mm (robust sigma), {:+.3f} mm in the middle{}\n",
                        overlap.station, overlap.difference_mm, overlap.offset_mm,
                        sigma_mm ? fmt::format(" (sigma {:.3f} mm)", *sigma_mm) : "");
  }
  return text;
}

json deviation_json(const DeviationSummary& summary) {
  return {{"points", summary.points},
          {"rms_mm", summary.rms_mm},
          {"trimmed_rms_mm", summary.trimmed_rms_mm},
          {"trimmed_share", summary.trimmed_share},
          {"mean_mm", summary.mean_mm},
          {"robust_sigma_mm", summary.robust_sigma_mm},
          {"max_mm", summary.max_mm},
          {"predicted_mm", summary.predicted_mm},
          {"observed_over_predicted", summary.observed_over_predicted},
          {"moved_rms_mm", summary.moved_rms_mm},
          {"moved_over_predicted", summary.moved_over_predicted},
          {"moved_all_rms_mm", summary.moved_all_rms_mm}};
}

json truth_json(const std::vector<EstimatorTruth>& truth) {
  json result{{"cloud_rms_mm", json::object()}, {"estimators", json::object()}};
  for (const EstimatorTruth& one : truth) {
    result["cloud_rms_mm"][one.estimator] = one.cloud_rms_mm();
    if (one.in_world) result["cloud_raw_rms_mm"][one.estimator] = one.summary.rms_mm;
    result["estimators"][one.estimator] = deviation_json(one.summary);
  }
  return result;
}

std::string truth_text(const std::vector<EstimatorTruth>& truth) {
  std::string text =
      "distance from the true surface (mm)\n"
      "  estimator       RMS  within 5 sigma  trimmed  robust sigma     mean      max  predicted  moved onto it\n";
  for (const auto& [estimator, s, in_world] : truth) {
    text += fmt::format("  {:9} {:9.4f} {:15.4f} {:6.2f} % {:13.4f} {:+8.4f} {:8.3f} {:10.4f} {:14.4f}\n", estimator,
                        s.rms_mm, s.trimmed_rms_mm, 100 * s.trimmed_share, s.robust_sigma_mm, s.mean_mm, s.max_mm,
                        s.predicted_mm, s.moved_rms_mm);
  }
  return text;
}

}  // namespace

std::vector<std::string> stations_off(const Reconstruction& reconstruction) {
  constexpr double kSigmas = 4;
  std::vector<std::string> off;
  const WrittenCloud& cloud = reconstruction.clouds.front();
  if (!cloud.merged) return off;
  for (const StationOverlap& overlap : cloud.merged->stations) {
    const auto sigma_mm = offset_sigma_mm(overlap, cloud);
    if (overlap.shared_sites == 0 || !sigma_mm || std::abs(overlap.offset_mm) <= kSigmas * *sigma_mm) continue;
    off.push_back(fmt::format(
        "station {} lies {:+.3f} mm off those before it, where rig and poses are known to {:.3f} mm: the probe, a "
        "tracker or what is scanned moved between its LEDs and its stripes, or the rig no longer holds; scan it again",
        overlap.station, overlap.offset_mm, *sigma_mm));
  }
  return off;
}

json reconstruction_summary(const Reconstruction& reconstruction) {
  json summary{{"schema", "crumple-cloud-summary/1"},
               {"estimator", reconstruction.estimators.front()},
               {"points", reconstruction.clouds.front().points},
               {"stations", json::array()},
               {"failed", json::array()}};
  for (const ReconstructedView& view : reconstruction.views) summary["stations"].push_back(view_json(view));
  for (const FailedView& view : reconstruction.failed) {
    summary["failed"].push_back({{"id", view.station}, {"camera", view.camera}, {"reason", view.reason}});
  }
  for (const auto& [station, choice] : reconstruction.choices) summary["choices"][station] = choice_json(choice);
  if (!reconstruction.stillness_not_tested.empty()) {
    summary["stillness_not_tested"] = reconstruction.stillness_not_tested;
  }
  for (const WrittenCloud& cloud : reconstruction.clouds) {
    if (cloud.merged) summary["merged"][cloud.estimator] = merge_json(cloud);
    if (cloud.not_smoothed > 0) summary["not_smoothed"][cloud.estimator] = cloud.not_smoothed;
  }
  if (const auto off = stations_off(reconstruction); !off.empty()) summary["reasons"] = off;
  if (!reconstruction.rig.document.is_null()) summary["rig_check"] = reconstruction.rig.document;
  if (!reconstruction.refined.is_null()) summary["refined"] = reconstruction.refined;
  if (!reconstruction.uncertainty.is_null()) summary["uncertainty"] = reconstruction.uncertainty;
  if (!reconstruction.truth.empty()) summary["truth"] = truth_json(reconstruction.truth);
  for (const auto& [rig, of_cloud, in_world] : reconstruction.compared) {
    summary["truth"]["world_rms_mm"][rig] = of_cloud.moved_rms_mm;
    summary["truth"]["world_raw_rms_mm"][rig] = of_cloud.trimmed_rms_mm;
  }
  return summary;
}

std::string reconstruction_text(const Reconstruction& reconstruction) {
  std::string text = reconstruction.rig.text + reconstruction.refined_text;
  for (const auto& [station, choice] : reconstruction.choices) {
    text += fmt::format("{}: {}\n", station, choice_text(choice));
  }
  text += untested_text(reconstruction.stillness_not_tested);
  for (const ReconstructedView& view : reconstruction.views) {
    text += fmt::format("{}, {}, {}: {} points, {:.1f} % of the lit pixels, median sigma {:.4f} mm\n", view.station,
                        view.camera, view.estimator, view.points, 100 * view.decoded_fraction, view.median_sigma_mm);
    for (const OrientationReport& orientation : view.orientations) {
      if (!orientation.used) text += fmt::format("  {}\n", orientation.reason);
    }
    if (view.removed.total() > 0) {
      text += fmt::format("  removed: {} isolated, {} off the surface, {} grazing, {} at edges\n",
                          view.removed.isolated, view.removed.off_surface, view.removed.grazing, view.removed.edge);
    }
  }
  for (const WrittenCloud& cloud : reconstruction.clouds) {
    if (cloud.merged) text += merge_text(cloud);
  }
  for (const std::string& off : stations_off(reconstruction)) text += "not to be trusted: " + off + "\n";
  text += reconstruction.uncertainty_text;
  for (const FailedView& view : reconstruction.failed) {
    text += fmt::format("failed: station {}, {}: {}\n", view.station, view.camera, view.reason);
  }
  if (!reconstruction.truth.empty()) text += truth_text(reconstruction.truth);
  if (!reconstruction.compared.empty())
    text += "by rig: RMS (mm) in the world frame, and after one rigid move onto the surface\n";
  for (const auto& [rig, of_cloud, in_world] : reconstruction.compared) {
    text += fmt::format("  {:12} {:9.4f} {:9.4f}\n", rig, of_cloud.trimmed_rms_mm, of_cloud.moved_rms_mm);
  }
  return text;
}

}  // namespace crumple
