// How well a calibration knows where each sensor sees things, over its image at the distance it worked at or at any
// other: the projection uncertainty (solvers/projection_uncertainty.h) at the middle of each cell of a report's grid.
#pragma once

#include <optional>
#include <vector>

#include "calib/calibrate.h"
#include "calib/image_cells.h"

namespace crumple {

struct SensorUncertainty {
  double distance_mm = 0;                       // from its centre of projection; may be infinite
  std::vector<std::optional<double>> sigma_px;  // in the worst direction, by cell; none where the pixel has no ray
};

// At the median distance of what it saw. One per sensor, by the grids of `cells`; none for a sensor that saw no board,
// nor LEDs that span a frame.
std::vector<std::optional<SensorUncertainty>> sensor_uncertainties(const Calibration& calibration,
                                                                   const std::vector<ImageCells>& cells);

// Along the sensor's axis, of the boards and LED frames that it saw; none where it saw nothing.
std::optional<double> median_depth_mm(std::size_t sensor, const BundleResult& bundle);

// At each of the distances, above 0. A list per sensor; an empty one where on its mount neither a board nor LEDs that
// span a frame were seen.
std::vector<std::vector<SensorUncertainty>> sensor_uncertainty_maps(const Calibration& calibration,
                                                                    const std::vector<ImageCells>& cells,
                                                                    const std::vector<double>& distances_mm);

}  // namespace crumple
