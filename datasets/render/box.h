// A solid box, such as the body of a probe: what it hides.
#pragma once

#include <optional>

#include <Eigen/Core>

#include "solvers/pose.h"

namespace crumple {

struct Box {
  Pose mount_from_box;                                // the box's frame has its origin in the middle
  Eigen::Vector3d size_mm = Eigen::Vector3d::Ones();  // along its axes
};

// Where the ray origin + t * direction enters the box, t >= 0, in the box's own frame; 0 from inside.
std::optional<double> entry(const Box& box, const Eigen::Vector3d& origin, const Eigen::Vector3d& direction);

// Whether a point of its mount's frame lies in the box.
bool contains(const Box& box, const Eigen::Vector3d& point);

// Whether it stands between two points of its mount's frame.
bool stands_between(const Box& box, const Eigen::Vector3d& a, const Eigen::Vector3d& b);

}  // namespace crumple
