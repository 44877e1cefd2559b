// Small patches of the surface that a station measured, each one a stripe coordinate at a camera pixel and a normal:
// what stations are held against each other by (recon/overlap.h). They keep what was read, not what a rig made of it,
// so that a refinement may move the rig.
//
// A patch is a plane fit to the coordinates of (2 radius + 1)^2 pixels about a node of a grid: its value in the middle,
// and with its slopes the normal. Left out: nodes with too few readings, and where the coordinates scatter about the
// plane by much more than their sigma says (an edge, a step, a curve tighter than the patch).
#pragma once

#include <optional>
#include <vector>

#include <Eigen/Core>

#include "recon/station.h"

namespace crumple {

struct SurfacePatch {
  Eigen::Vector2d camera_pixel = Eigen::Vector2d::Zero();
  double coordinate_px = 0;
  Eigen::Vector3d position_mm = Eigen::Vector3d::Zero();  // in the probe frame
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();       // likewise, unit, towards the camera
};

struct PatchOptions {
  int step_px = 8;            // of the grid
  int radius_px = 5;          // of a patch
  double least_filled = 0.9;  // share of its pixels that are read
  double gate = 3;            // on the scatter about the plane over what sigma says, both RMS
};

// By the readings of one orientation, in the order of the grid's rows.
std::vector<SurfacePatch> surface_patches(const StationGeometry& geometry, const StripeOrientation& orientation,
                                          const StripeCoordinates& coordinates, const PatchOptions& options = {});

// The orientation that sees depth best of those that were used.
std::optional<std::size_t> best_orientation(const std::vector<OrientationReport>& orientations);

}  // namespace crumple
