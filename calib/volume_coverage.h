// What of the measuring volume the boards stood in: the first camera on the probe (or the first in the world, of a rig
// without a probe) sees it as thirds by thirds of its image, deep from the nearest to the farthest of its accepted
// corners, in thirds again. Nothing tells the rig how near and far it will measure: boards do.
//
// Shallow: the farthest corner is less than a quarter farther away than the nearest. Then what a lens does with
// distance, and how sensors of one mount stand to each other along it, is extrapolated soon.
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <vector>

#include "solvers/bundle.h"

namespace crumple {

struct VolumeCoverage {
  std::size_t camera = 0;
  double near_mm = 0;  // along its axis
  double far_mm = 0;
  std::array<std::size_t, 27> corners{};  // accepted; the nearest nine parts first, row by row

  int covered() const;  // of the 27
  bool shallow() const;
};

// None where no camera saw a board.
// `views` are those of the bundle, which begin with the corners.
std::optional<VolumeCoverage> volume_coverage(const Observations& observations, const CalibrationState& state,
                                              const std::vector<ViewSummary>& views);

}  // namespace crumple
