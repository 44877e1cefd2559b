#include "calib/calibration_figures.h"

#include <utility>

namespace crumple {

CalibrationFigures calibration_figures(const CalibrationData& data, const Calibration& calibration, int threads) {
  const BundleResult& bundle = calibration.bundle;
  CalibrationFigures figures;
  figures.budget = uncertainty_budget(data.observations, calibration, threads);
  figures.residuals = placed_residuals(data.observations, bundle);
  for (std::size_t s = 0; s < figures.residuals.size(); ++s) {
    figures.cells.push_back(image_cells(figures.residuals[s], bundle.state.rig.sensors[s].lens.size()));
  }
  figures.uncertainties = sensor_uncertainties(calibration, figures.cells);
  figures.histograms = residual_histograms(bundle);
  figures.correlated = correlated_terms(rig_covariance(bundle));
  if (auto volume = volume_points(data, calibration)) figures.volume = std::move(*volume);
  return figures;
}

}  // namespace crumple
