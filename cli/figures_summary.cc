#include "cli/figures_summary.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

namespace crumple {
namespace {

using nlohmann::json;

// JSON has no infinity.
json finite_json(double number) { return std::isfinite(number) ? json(number) : json(); }

json budget_json(const UncertaintyBudget& budget) {
  json result{
      {"k", kCoverageFactor}, {"sources", json::array()}, {"entries", json::array()}, {"regions", json::array()}};
  for (const BudgetSource& source : budget.sources) {
    result["sources"].push_back({{"name", source.name},
                                 {"type", source.type_b ? "B" : "A"},
                                 {"degrees_of_freedom", finite_json(source.degrees_of_freedom())}});
  }
  for (const BudgetEntry& entry : budget.entries) {
    result["entries"].push_back({{"part", entry.part},
                                 {"name", entry.name},
                                 {"unit", entry.unit},
                                 {"value", entry.value},
                                 {"u", entry.u},
                                 {"U", kCoverageFactor * entry.u},
                                 {"degrees_of_freedom", finite_json(entry.degrees_of_freedom)},
                                 {"type_b_share", entry.type_b_share},
                                 {"shares", entry.shares}});
  }
  for (const BudgetRegion& region : budget.regions) {
    result["regions"].push_back({{"part", region.part},
                                 {"dimension", region.dimension},
                                 {"scale", region.scale},
                                 {"degrees_of_freedom", finite_json(region.degrees_of_freedom)}});
  }
  return result;
}

json cells_json(const ImageCells& cells) {
  json counts = json::array(), means = json::array();
  for (const ImageCell& cell : cells.cells) {
    counts.push_back(cell.observations);
    means.push_back(cell.mean_px ? json{cell.mean_px->x(), cell.mean_px->y()} : json());
  }
  return {{"columns", cells.columns},         {"rows", cells.rows},
          {"covered", cells.covered},         {"rms_mean_px", cells.rms_mean_px},
          {"expected_px", cells.expected_px}, {"observations", std::move(counts)},
          {"mean_px", std::move(means)}};
}

json uncertainty_json(const SensorUncertainty& uncertainty) {
  json sigmas = json::array();
  for (const std::optional<double>& sigma_px : uncertainty.sigma_px)
    sigmas.push_back(sigma_px ? json(*sigma_px) : json());
  return {{"distance_mm", finite_json(uncertainty.distance_mm)}, {"sigma_px", std::move(sigmas)}};
}

json histogram_json(const ResidualHistogram& histogram) {
  return {{"lowest", -kHistogramReach},      {"bin", kHistogramBin},       {"accepted", histogram.accepted},
          {"outliers", histogram.outliers},  {"beyond", histogram.beyond}, {"mean", histogram.mean},
          {"deviation", histogram.deviation}};
}

json regional_json(const RegionalTest& test) {
  return {{"parts", test.parts},
          {"chi_square", test.chi_square},
          {"degrees_of_freedom", test.degrees_of_freedom},
          {"probability", test.probability},
          {"rms_sigmas", test.rms_sigmas},
          {"pattern", test.pattern()},
          {"worst_part", test.worst_part},
          {"worst_mean_px", {test.worst_mean_px.x(), test.worst_mean_px.y()}},
          {"worst_sigmas", test.worst_sigmas},
          {"worst_probability", test.worst_probability}};
}

json covered_json(const VolumeCoverage& covered, const Rig& rig) {
  return {{"camera", rig.sensors[covered.camera].name},
          {"near_mm", covered.near_mm},
          {"far_mm", covered.far_mm},
          {"covered", covered.covered()},
          {"corners", covered.corners}};
}

json correlated_json(const CorrelatedTerms& correlated) {
  json strongest = json::array();
  for (const CorrelatedPair& pair : correlated.strongest) {
    strongest.push_back({{"first", pair.first}, {"second", pair.second}, {"correlation", pair.correlation}});
  }
  return {{"above", kCorrelationLimit}, {"pairs", correlated.pairs}, {"strongest", std::move(strongest)}};
}

json volume_json(const VolumePoints& volume, const Calibration& calibration) {
  json points = json::array();
  for (const VolumePoint& point : volume.points) {
    const Eigen::Vector3d u_mm = point.covariance_mm2.diagonal().cwiseSqrt();
    points.push_back({{"column", point.column},
                      {"row", point.row},
                      {"depth_mm", point.depth_mm},
                      {"station", point.station ? json(calibration.station_names[*point.station]) : json()},
                      {"u_mm", {u_mm.x(), u_mm.y(), u_mm.z()}}});
  }
  return {{"camera", calibration.bundle.state.rig.sensors[volume.camera].name},
          {"frame", volume.frame == Mount::world ? "world" : "probe"},
          {"points", std::move(points)}};
}

}  // namespace

json figures_summary(const CalibrationFigures& figures, const Calibration& calibration) {
  const Rig& rig = calibration.bundle.state.rig;
  json summary{{"budget", budget_json(figures.budget)},
               {"correlated", correlated_json(figures.correlated)},
               {"image_cells", json::object()},
               {"histograms", json::object()}};
  for (std::size_t s = 0; s < figures.cells.size(); ++s) {
    summary["image_cells"][rig.sensors[s].name] = cells_json(figures.cells[s]);
    if (figures.uncertainties[s]) {
      summary["projection_uncertainty"][rig.sensors[s].name] = uncertainty_json(*figures.uncertainties[s]);
    }
    for (const SensorUncertainty& map : figures.maps[s]) {
      summary["projection_uncertainty_maps"][rig.sensors[s].name].push_back(uncertainty_json(map));
    }
  }
  for (const ResidualHistogram& histogram : figures.histograms) {
    summary["histograms"][histogram.group] = histogram_json(histogram);
  }
  for (const RegionalTest& test : figures.regional) {
    summary["regional_tests"][group_name(rig, test.sensor, test.kind)] = regional_json(test);
  }
  if (figures.covered) summary["volume_coverage"] = covered_json(*figures.covered, rig);
  if (figures.volume) summary["volume_points"] = volume_json(*figures.volume, calibration);
  return summary;
}

std::string projection_maps_text(const CalibrationFigures& figures, const Calibration& calibration) {
  std::string text;
  for (std::size_t s = 0; s < figures.maps.size(); ++s) {
    for (const SensorUncertainty& map : figures.maps[s]) {
      std::vector<double> sigmas_px;
      for (const auto& sigma_px : map.sigma_px) {
        if (sigma_px) sigmas_px.push_back(*sigma_px);
      }
      if (sigmas_px.empty()) continue;
      const auto [least, largest] = std::minmax_element(sigmas_px.begin(), sigmas_px.end());
      text += fmt::format("projection uncertainty of {} {}: {:.3g} to {:.3g} px over its image\n",
                          calibration.bundle.state.rig.sensors[s].name,
                          std::isinf(map.distance_mm) ? "at infinity" : fmt::format("at {:g} mm", map.distance_mm),
                          *least, *largest);
    }
  }
  return text;
}

}  // namespace crumple
