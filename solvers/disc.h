// The centre of gravity of a disc's image.
//
// Perspective and distortion do not map the centre of a disc to the centre of its image: for a disc of 10 mm seen at
// 45 degrees from 500 mm the two are 0.1 px apart or more. What a detector measures is the centre of gravity of the
// image's area, so that is predicted: the disc's outline, a regular polygon, is projected corner by corner, and the
// centre of gravity of the polygon in the image taken (Green's theorem). The polygon's radius is chosen so that its
// second moments are the disc's, which makes the prediction exact to the fourth order of the disc's size.
#pragma once

#include <array>

#include <Eigen/Core>

namespace crumple {

constexpr int kDiscVertices = 24;

using DiscOutline = std::array<Eigen::Vector2d, kDiscVertices>;

// About the origin of the disc's plane.
DiscOutline disc_outline(double radius);

// Precondition: the outline encloses an area.
Eigen::Vector2d centroid(const DiscOutline& outline);

struct CentroidDerivative {
  Eigen::Vector2d centroid;
  std::array<Eigen::Matrix2d, kDiscVertices> d_vertex;
};
CentroidDerivative centroid_with_derivative(const DiscOutline& outline);

}  // namespace crumple
