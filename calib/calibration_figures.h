// What a calibration's report shows beyond the fit itself, computed once for report.html and summary.json.
#pragma once

#include <optional>
#include <vector>

#include "calib/correlated_terms.h"
#include "calib/image_cells.h"
#include "calib/placed_residuals.h"
#include "calib/residual_histogram.h"
#include "calib/sensor_uncertainty.h"
#include "calib/uncertainty_budget.h"
#include "calib/volume_uncertainty.h"

namespace crumple {

struct CalibrationFigures {
  UncertaintyBudget budget;
  std::vector<std::vector<PlacedResidual>> residuals;           // one list per sensor
  std::vector<ImageCells> cells;                                // one per sensor
  std::vector<std::optional<SensorUncertainty>> uncertainties;  // likewise
  std::vector<ResidualHistogram> histograms;                    // one per group of observations
  CorrelatedTerms correlated;
  std::optional<VolumePoints> volume;  // none where volume_points fails
};

// `data` is what the calibration was made from.
CalibrationFigures calibration_figures(const CalibrationData& data, const Calibration& calibration, int threads);

}  // namespace crumple
