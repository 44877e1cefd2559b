// What a calibration's report shows beyond the fit itself, computed once for report.html and summary.json.
#pragma once

#include <optional>
#include <vector>

#include "calib/correlated_terms.h"
#include "calib/image_cells.h"
#include "calib/placed_residuals.h"
#include "calib/regional_tests.h"
#include "calib/residual_histogram.h"
#include "calib/sensor_uncertainty.h"
#include "calib/uncertainty_budget.h"
#include "calib/volume_coverage.h"
#include "calib/volume_uncertainty.h"

namespace crumple {

struct CalibrationFigures {
  UncertaintyBudget budget;
  std::vector<std::vector<PlacedResidual>> residuals;           // one list per sensor
  std::vector<ImageCells> cells;                                // one per sensor
  std::vector<std::optional<SensorUncertainty>> uncertainties;  // likewise
  std::vector<std::vector<SensorUncertainty>> maps;             // likewise, at the distances asked for
  std::vector<ResidualHistogram> histograms;                    // one per group of observations
  std::vector<RegionalTest> regional;                           // likewise
  CorrelatedTerms correlated;
  std::optional<VolumePoints> volume;  // none where volume_points fails
  std::optional<VolumeCoverage> covered;
};

// `data` is what the calibration was made from; `map_distances_mm` where it is to be mapped how well sensors'
// projections are known, beside the distances they worked at.
CalibrationFigures calibration_figures(const CalibrationData& data, const Calibration& calibration, int threads,
                                       const std::vector<double>& map_distances_mm = {});

}  // namespace crumple
