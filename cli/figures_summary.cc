#include "cli/figures_summary.h"

#include <cmath>

namespace crumple {
namespace {

using nlohmann::json;

// JSON has no infinity.
json degrees_json(double degrees) { return std::isfinite(degrees) ? json(degrees) : json(); }

json budget_json(const UncertaintyBudget& budget) {
  json result{
      {"k", kCoverageFactor}, {"sources", json::array()}, {"entries", json::array()}, {"regions", json::array()}};
  for (const BudgetSource& source : budget.sources) {
    result["sources"].push_back({{"name", source.name},
                                 {"type", source.type_b ? "B" : "A"},
                                 {"degrees_of_freedom", degrees_json(source.degrees_of_freedom())}});
  }
  for (const BudgetEntry& entry : budget.entries) {
    result["entries"].push_back({{"part", entry.part},
                                 {"name", entry.name},
                                 {"unit", entry.unit},
                                 {"value", entry.value},
                                 {"u", entry.u},
                                 {"U", kCoverageFactor * entry.u},
                                 {"degrees_of_freedom", degrees_json(entry.degrees_of_freedom)},
                                 {"type_b_share", entry.type_b_share},
                                 {"shares", entry.shares}});
  }
  for (const BudgetRegion& region : budget.regions) {
    result["regions"].push_back({{"part", region.part},
                                 {"dimension", region.dimension},
                                 {"scale", region.scale},
                                 {"degrees_of_freedom", degrees_json(region.degrees_of_freedom)}});
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
  return {{"distance_mm", uncertainty.distance_mm}, {"sigma_px", std::move(sigmas)}};
}

json histogram_json(const ResidualHistogram& histogram) {
  return {{"lowest", -kHistogramReach},      {"bin", kHistogramBin},       {"accepted", histogram.accepted},
          {"outliers", histogram.outliers},  {"beyond", histogram.beyond}, {"mean", histogram.mean},
          {"deviation", histogram.deviation}};
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
  }
  for (const ResidualHistogram& histogram : figures.histograms) {
    summary["histograms"][histogram.group] = histogram_json(histogram);
  }
  if (figures.volume) summary["volume_points"] = volume_json(*figures.volume, calibration);
  return summary;
}

}  // namespace crumple
