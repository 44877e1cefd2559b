// Surface normals on an organised grid of points.
#pragma once

#include <Eigen/Core>
#include <opencv2/core/mat.hpp>

#include "solvers/lens.h"

namespace crumple {

// The unit normal, towards the camera, in the camera's frame, from the differences to the neighbours two pixels to the
// left and right, above and below (one-sided where a neighbour has no depth). Zero where an axis has no neighbour at
// all, or where the depth jumps by more than `largest_slope` times the distance across: the surface is broken there.
Eigen::Vector3d grid_normal(const cv::Mat& depth_mm, const RayTable& rays, int x, int y, double largest_slope = 5);

}  // namespace crumple
