// Small rigid motions of what stands in a frame: the 6-vector (w, t), rad and mm, moves a point x of the frame by
// w x x + t. Unlike the tangent of a pose (solvers/pose.h), whose rotation leaves the body's origin where it is, the
// same motion means the same for every body in the frame: motions of several bodies can be averaged.
#pragma once

#include <vector>

#include "solvers/pose.h"

namespace crumple {

// The motion from the tangent (w, d) of frame_from_body: (w, d - w x translation).
Matrix6d d_motion_d_pose(const Pose& frame_from_body);

// How points move with the motion: three rows per point.
Eigen::MatrixXd d_points_d_motion(const std::vector<Eigen::Vector3d>& points);

// The motion that explains small displacements of points best, three columns per point; asserts that three of the
// points are not on a line.
Eigen::MatrixXd d_motion_d_points(const std::vector<Eigen::Vector3d>& points);

// Whether a rigid motion can be told from displacements of these points: three of them span a triangle whose height is
// not less than a thousandth of its base.
bool span_a_frame(const std::vector<Eigen::Vector3d>& points);

}  // namespace crumple
