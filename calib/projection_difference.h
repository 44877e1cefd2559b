// How differently two calibrations of one sensor project, over its image and
// beside both uncertainties.
//
// A grid of pixels of A sees points at a distance along its rays, or at
// infinity. B projects them to other pixels, after the small rigid motion of
// B's frame against A's that fits best, weighted by both uncertainties: where a
// sensor's frame sits in its housing shifts from calibration to calibration,
// and shows in the mount and not in the image (Kogan, mrcal's "Differences in
// projection"). At infinity the motion is a rotation. What is left is compared
// with the covariance of both lenses (solvers/aligned_difference.h), which are
// taken as independent. The lens models may differ.
#pragma once

#include <vector>

#include "solvers/aligned_difference.h"
#include "solvers/expected.h"
#include "solvers/rig.h"

namespace crumple {

// Below it a difference counts as none.
constexpr double kNoDifference_px = 1e-3;

struct ProjectionGrid {
  int columns = 16;
  int rows = 12;
  double distance_mm = 0;  // along the ray; may be infinite
  double no_difference_px = kNoDifference_px;
};

struct ProjectionDifference {
  std::vector<Eigen::Vector2d> pixels;  // of A, that both see, row by row
  AlignedDifference px;                 // B minus A, a point for each
  Pose b_from_a;
};

// Fails where the images differ in size, or hardly anything is seen by both.
Expected<ProjectionDifference> projection_difference(const Rig& a, std::size_t sensor_a, const Rig& b,
                                                     std::size_t sensor_b, const ProjectionGrid& grid);

// The rows of a sensor's lens in a rig's covariance, which are another sensor's
// where it shares that one's.
std::vector<std::string> lens_row_names(const Rig& rig, std::size_t sensor);

}  // namespace crumple
