// What one tracker saw of the LEDs at one time, as tracking takes it: pixels with their covariances.
#pragma once

#include <vector>

#include <Eigen/Core>

#include "solvers/observations.h"

namespace crumple {

struct LedReading {
  LedView view;
  std::vector<Eigen::Matrix2d> covariances_px2;  // in the order of view.leds
};

// All trackers at one time.
using LedReadings = std::vector<LedReading>;

}  // namespace crumple
