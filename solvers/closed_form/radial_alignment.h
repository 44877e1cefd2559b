// Where boards stand before a camera of unknown radial distortion, however strong.
//
// Source: the radial alignment constraint of R. Tsai (A Versatile Camera Calibration Technique, 1987): a point's image
// lies on the line from the distortion's centre in the direction (x, y) of the point in the camera's frame. Per view
// that is linear in the first two rows of the pose, whatever the lens does along the line. Then D. Scaramuzza,
// A. Martinelli and R. Siegwart (A Toolbox for Easily Calibrating Omnidirectional Cameras, 2006, section III): with the
// ray of a pixel at radius r from the centre along (u, v, g(r)), g(r) = a0 + a2 r^2 + a4 r^4, the distances of all
// views and g follow from one linear system. A pinhole has g = focal length.
//
// Square pixels; the centre is known, or nearly: for the start of a refinement the image's middle will do. Degenerate
// where all planes are parallel to the image (distance and focal length can be exchanged), which is measured and
// refused.
#pragma once

#include <optional>
#include <vector>

#include <Eigen/Core>

#include "solvers/closed_form/homography.h"
#include "solvers/expected.h"
#include "solvers/pose.h"

namespace crumple {

struct PlaneView {
  Points2d plane_mm;
  Points2d pixels;
};

// sensor_from_plane of every view, planes before the sensor; none for a view of fewer than six points, of points whose
// images do not tell its rotation, or that no pose with its plane in front explains. Fails where the views together do
// not tell their distances.
Expected<std::vector<std::optional<Pose>>> align_radially(const Eigen::Vector2d& centre_px,
                                                          const std::vector<PlaneView>& views);

}  // namespace crumple
