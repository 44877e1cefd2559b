// The point that a camera pixel and the stripe coordinate met there say, in the probe frame, and how it moves with the
// lenses and mounts of camera and projector: the ray meets the stripe's surface of light (as recon/triangulate.h has
// it), its derivatives follow by the implicit function theorem.
#pragma once

#include <cstddef>
#include <optional>

#include <Eigen/Core>

#include "solvers/rig.h"

namespace crumple {

using Matrix3Xd = Eigen::Matrix<double, 3, Eigen::Dynamic>;

// A camera's ray in the probe frame: origin + depth * direction, depth being the camera's z.
struct ProbeRay {
  Eigen::Vector3d origin_mm;
  Eigen::Vector3d direction;
  Matrix3Xd d_lens;           // of the direction, by the camera's lens; where asked for
  Eigen::Matrix3d to_camera;  // the mount's rotation
  Eigen::Vector3d at(double depth) const { return origin_mm + depth * direction; }
  // At fixed depth, by the tangent of the camera's mount.
  Matrix3x6d d_mount(double depth) const;
};

// No value where the pixel has no ray forward.
std::optional<ProbeRay> probe_ray(const Sensor& camera, const Eigen::Vector2d& pixel, bool with_derivatives);

// A stripe coordinate of a point in the probe frame, with its derivatives.
struct StripeCoordinate {
  double value_px = 0;
  Eigen::RowVector3d d_point;
  Eigen::RowVectorXd d_lens;  // of the projector
  Eigen::RowVector<double, 6> d_mount;
};

// No value where the projector does not light the point.
std::optional<StripeCoordinate> stripe_coordinate(const Sensor& projector, const Eigen::Vector2d& normal,
                                                  const Eigen::Vector3d& in_probe);

struct StripePoint {
  Eigen::Vector3d in_probe;
  Matrix3Xd d_camera_lens;  // these only where asked for
  Matrix3x6d d_camera_mount;
  Matrix3Xd d_projector_lens;
  Matrix3x6d d_projector_mount;
  Eigen::Vector3d d_coordinate;  // mm per px; likewise
};

// No value where the ray does not meet the light before both sensors, or runs (nearly) within it.
std::optional<StripePoint> stripe_point(const Sensor& camera, const Sensor& projector, const Eigen::Vector2d& normal,
                                        const Eigen::Vector2d& pixel, double coordinate_px,
                                        bool with_derivatives = true);

}  // namespace crumple
