// residuals.csv of a calibration: one line per observation.
//
//   placement,camera,sensor,kind,index,x_px,y_px,residual_1_px,residual_2_px,accepted,redundancy,standardised_residual
//
// x and y are the camera pixel. `sensor` is whose noise the residual carries: the camera's for corners and features
// (along x and y), the projector's for stripes (along the stripes' normal; the second is empty). `index` is the marked
// point on the board; of stripes and features it counts within their view. Residuals are predicted minus measured.
// The last two are ViewSummary's; an observation that was left out has no redundancy. Numbers have the digits it takes
// to read them back exactly; names with a comma or quotes are quoted (RFC 4180).
#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>

#include "calib/calibrate.h"
#include "solvers/expected.h"

namespace crumple {

// `observations` are those that the calibration was made from.
std::string residuals_csv(const Calibration& calibration, const Observations& observations);

// The corners of one board placement in one camera, as residuals.csv has them.
struct RecordedCorners {
  std::string placement;
  std::string camera;
  std::vector<int> corners;  // marked points
  std::vector<Eigen::Vector2d> pixels;
  std::vector<Eigen::Vector2d> residuals_px;
  std::vector<char> accepted;
};

// The corners alone, view by view in the order of the file, which may lack the last two columns. Fails, naming file and
// line, on another header, a line of another length and a number that cannot be read.
Expected<std::vector<RecordedCorners>> parse_recorded_corners(const std::string& csv, const std::string& file_name);

}  // namespace crumple
