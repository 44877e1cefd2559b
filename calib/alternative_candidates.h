// The alternatives that a calibration's data allow to test (calib/alternatives.h), as derivatives of the residuals.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "calib/alternatives.h"

namespace crumple {

struct AlternativeCandidate {
  AlternativeKind kind;
  std::string subject;  // the board, sensor or LED it is about
  ScoreTester::Columns columns;
  std::function<std::string(const ScoreOutcome&)> sentence;
};

std::vector<AlternativeCandidate> alternative_candidates(const CalibrationData& data, const Calibration& calibration,
                                                         const ScoreTester& tester);

}  // namespace crumple
