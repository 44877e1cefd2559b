// report.html of a calibration: one file that opens offline and prints on A4, readable without scripts. What its
// figures mean stands in docs/report.md.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "calib/calibration_figures.h"
#include "calib/cross_validate.h"
#include "calib/fold_differences.h"
#include "calib/skipped_view.h"
#include "calib/verdict.h"
#include "datasets/capture.h"
#include "datasets/run_record.h"
#include "solvers/expected.h"

namespace crumple {

// Refers to what it is made from.
struct CalibrationReport {
  const Capture& capture;
  const Calibration& calibration;
  const Verdict& verdict;
  const CalibrationFigures& figures;
  const std::vector<SkippedView>& skipped;
  const std::optional<FoldDifferences>& folds;
  const std::optional<CrossValidation>& validation;  // of boards left out
  const RunRecord& record;
  std::string command;  // as it was typed
};

// The same bytes for the same report. Fails where the plots cannot be drawn (datasets/report/gnuplot.h).
Expected<std::string> calibration_report_html(const CalibrationReport& report);

}  // namespace crumple
