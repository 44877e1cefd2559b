// A view as it counted in a calibration's last solve: whitened by its group's sigma, its outliers blank, correlated
// observations discounted.
#pragma once

#include "calib/calibrate.h"

namespace crumple {

// Whether any of view v's observations counted. One of which none did need not be predictable.
bool counted(const Calibration& calibration, std::size_t v);

// `view` is the one of that number in make_views of the calibration's observations. False where it cannot be predicted.
bool whitened_view(const Calibration& calibration, const View& view, std::size_t v, ViewEvaluation& evaluation);

}  // namespace crumple
