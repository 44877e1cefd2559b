// Which points of a cloud a feature is measured from. Points that stations contradict each other on (quality 0) are
// never among them.
#pragma once

#include <cstddef>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "recon/cloud.h"
#include "solvers/expected.h"

namespace crumple {

std::vector<std::size_t> points_within(const Cloud& cloud, const Eigen::Vector3d& place_mm, double radius_mm);
std::vector<std::size_t> points_within(const Cloud& cloud, const Eigen::AlignedBox3d& box_mm);

// Of a sphere whose centre is known to a quarter of its radius: those near its surface, told again from the sphere that
// fits them, closer and closer, down to 1/50 of the radius. Fails where fewer than 50 are left, where no sphere fits,
// where the one that fits is off the radius by more than a tenth, and where the cap that was seen is narrower than 25
// degrees about its axis: centre and radius tell each other then.
Expected<std::vector<std::size_t>> points_on_sphere(const Cloud& cloud, const Eigen::Vector3d& near_mm,
                                                    double radius_mm);

}  // namespace crumple
