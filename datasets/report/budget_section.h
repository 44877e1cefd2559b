// Tables of what is known, how well, and from what: the uncertainty budget, parameters that only move together, and the
// direction that is known least.
#pragma once

#include <string>

#include "datasets/report/calibration_report.h"

namespace crumple {

std::string budget_section(const CalibrationReport& report);

std::string correlation_section(const CorrelatedTerms& correlated, const JointCovariance& covariance);

}  // namespace crumple
