// residuals.csv of a calibration: one line per observation.
//
//   placement,camera,sensor,kind,index,x_px,y_px,residual_1_px,residual_2_px,accepted
//
// x and y are the camera pixel. `sensor` is whose noise the residual carries: the camera's for corners and features
// (along x and y), the projector's for stripes (along the stripes' normal; the second is empty). `index` is the marked
// point on the board; of stripes and features it counts within their view. Residuals are predicted minus measured.
#pragma once

#include <string>

#include "calib/calibrate.h"

namespace crumple {

// `observations` are those that the calibration was made from.
std::string residuals_csv(const Calibration& calibration, const Observations& observations);

}  // namespace crumple
