// Parts of sensors' images that no accepted observation lies in, of nine each, and how well the calibration knows what
// is seen there: the projection uncertainty at the distance the sensor worked at (calib/sensor_uncertainty.h), which
// there is the lens model's word alone.
//
// A part matters where a quarter of its cells or more do: cells whose pixel has a ray by the lens and, of a projector,
// whose ray a camera beside it can see at that distance. No board could do anything about others.
#pragma once

#include <string>
#include <vector>

#include "calib/calibrate.h"
#include "calib/image_cells.h"
#include "calib/sensor_uncertainty.h"

namespace crumple {

struct UnseenPart {
  std::size_t sensor = 0;
  std::string name;          // "upper left", "top", "middle" ...
  double sigma_px = 0;       // RMS over its cells that matter
  double seen_sigma_px = 0;  // the same over the cells of the sensor's image that hold observations
};

// Sensor by sensor, row by row. `cells` and `uncertainties` have one per sensor; sensors without uncertainty are left
// out.
std::vector<UnseenPart> unseen_parts(const Rig& rig, const std::vector<ImageCells>& cells,
                                     const std::vector<std::optional<SensorUncertainty>>& uncertainties);

}  // namespace crumple
