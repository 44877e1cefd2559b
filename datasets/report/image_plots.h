// Drawings over a sensor's image: its pixels to scale, x to the right and y down, as on the sensor.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "calib/image_cells.h"
#include "datasets/report/gnuplot.h"
#include "solvers/lens.h"

namespace crumple {

// How many observations each cell holds; cells without any stay white.
Plot coverage_plot(ImageSize size, const ImageCells& cells);

// An arrow from where something was measured towards where it is predicted, enlarged, with one of a stated length
// beside the drawing. Single residuals: at most `most` of them, evenly chosen; outliers in another colour.
Plot residual_sample_plot(ImageSize size, const std::vector<PlacedResidual>& residuals, std::size_t most);
// The means of the cells.
Plot residual_field_plot(ImageSize size, const ImageCells& cells);

// A number per cell of a grid over the image, row by row; cells without a value stay white.
struct ImageMap {
  int columns = 0;
  int rows = 0;
  std::vector<std::optional<double>> values;
  std::string label;  // of the colour bar, with the unit
};
Plot image_map_plot(ImageSize size, const ImageMap& map);

}  // namespace crumple
