// An acceptance test after VDI/VDE 2634 parts 2 (single views) and 3 (merged views): what calibrated artefacts say of a
// cloud, observed against predicted.
//
//   probing form PF     range of the distances from the free-radius best-fit sphere
//   probing size PS     its diameter less the calibrated one
//   sphere spacing SD   distance of two spheres' centres less the calibrated one
//   length E            the same from outside to outside: SD plus half of both PS, over the calibrated length plus
//   radii flatness F          range of the distances from the best-fit plane
//
// Of PF and F, 0.3 % of the points at most are left out, the farthest ones. Predicted is the range that the points'
// own uncertainties would give: of residuals of variances s_i^2 (the fit's share and what is common in them), 2 z with
//   mean_i P(|N(0, s_i^2)| > z) = the share left out, at least half a point.
// PS, SD and E have their expanded uncertainties (k = 2) with the certificate's in them; beyond those the prediction
// has failed.
//
// A limit is kept where the observed value lies below it by 1.645 standard uncertainties of the certificate at least,
// exceeded where it lies above by as much, and undecided between (ISO 14253-1: one in twenty; the test value's
// uncertainty is the artefact's, ISO/TS 23165, since what the instrument errs by is what is tested). Certificates of
// spheres and plates state no form, which counts as none. Positions are counted: part 2 asks for ten of a sphere, seven
// of a ball bar and six of a plate, and a test with fewer is said to be a reduced one.
//
// Part 3 asks for five views or more to be merged; how many stations measured an artefact is told with it.
#pragma once

#include "cli/measurement.h"

namespace crumple {

struct AcceptanceReport {
  MeasurementReport report;
  bool accepted = true;  // all stated limits are kept
};

Expected<AcceptanceReport> acceptance_report(const MeasuredCloud& cloud, const AcceptancePlan& plan);

}  // namespace crumple
