// Parts of sensors' images that no accepted observation lies in, of nine each, and how well the calibration knows what
// is seen there: the projection uncertainty at the distance the sensor worked at (calib/sensor_uncertainty.h), which
// there is the lens model's word alone.
#pragma once

#include <string>
#include <vector>

#include "calib/calibrate.h"
#include "calib/image_cells.h"
#include "calib/sensor_uncertainty.h"

namespace crumple {

struct UnseenParts {
  std::size_t sensor = 0;
  std::vector<std::string> parts;  // "upper left", "top", "middle" ..., row by row
  double sigma_px = 0;             // RMS over the cells of the worst of them; infinite where a pixel has no ray
  double seen_sigma_px = 0;        // the same over all cells with observations
};

// Of the sensors that have such parts. `cells` and `uncertainties` have one per sensor; sensors without uncertainty are
// left out. Of a projector that counts which a camera beside it can see at the distance it worked at; a part counts
// where a quarter of it does.
std::vector<UnseenParts> unseen_parts(const Rig& rig, const std::vector<ImageCells>& cells,
                                      const std::vector<std::optional<SensorUncertainty>>& uncertainties);

}  // namespace crumple
