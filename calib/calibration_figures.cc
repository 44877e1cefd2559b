#include "calib/calibration_figures.h"

#include <utility>

namespace crumple {

CalibrationFigures calibration_figures(const CalibrationData& data, const Calibration& calibration, int threads,
                                       const std::vector<double>& map_distances_mm) {
  const BundleResult& bundle = calibration.bundle;
  CalibrationFigures figures;
  figures.budget = uncertainty_budget(data.observations, calibration, threads);
  figures.residuals = placed_residuals(data.observations, bundle);
  for (std::size_t s = 0; s < figures.residuals.size(); ++s) {
    figures.cells.push_back(image_cells(figures.residuals[s], bundle.state.rig.sensors[s].lens.size()));
  }
  figures.uncertainties = sensor_uncertainties(calibration, figures.cells);
  figures.maps = sensor_uncertainty_maps(calibration, figures.cells, map_distances_mm);
  figures.histograms = residual_histograms(bundle);
  figures.regional = regional_tests(figures.residuals, bundle.groups, bundle.state.rig, calibration.inflation);
  figures.correlated = correlated_terms(rig_covariance(calibration));
  if (auto volume = volume_points(data, calibration)) figures.volume = std::move(*volume);
  figures.covered = volume_coverage(data.observations, bundle.state, bundle.views);
  return figures;
}

}  // namespace crumple
