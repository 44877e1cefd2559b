// What was observed where in a sensor's image: a grid of nearly square cells, each with how many observations were
// accepted in it and their mean residual. It shows where a lens was never looked at, and what the model leaves over
// that noise does not explain.
//
// The mean m of a cell explains its residuals best: it minimises sum (n'(m - r))^2 / sigma^2, n the direction of a
// stripe reading; of residuals in two coordinates that is their weighted average. It is given where the cell knows both
// of its coordinates as well as kLeastForMean readings do. If the model is right, |m|^2 has the expectation
// tr (sum n n' / sigma^2)^-1, noise alone; root mean squares over the cells stand beside one another. The fit follows
// some of the noise, so that a right model leaves less than that, where there are few cells much less.
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "calib/placed_residuals.h"
#include "solvers/lens.h"

namespace crumple {

struct ImageCell {
  std::size_t observations = 0;  // accepted
  std::optional<Eigen::Vector2d> mean_px = {};
};

struct ImageCells {
  int columns = 0;
  int rows = 0;
  Eigen::Vector2d cell_px;       // width and height of one
  std::vector<ImageCell> cells;  // row by row
  double covered = 0;            // share of the cells with an observation
  double rms_mean_px = 0;        // length of the means, over the cells that have one
  double expected_px = 0;        // the same from noise alone

  Eigen::Vector2d centre_px(std::size_t cell) const;
};

inline constexpr double kLongSideCells = 16;
inline constexpr double kLeastForMean = 3;

ImageCells image_cells(const std::vector<PlacedResidual>& residuals, ImageSize size);

}  // namespace crumple
