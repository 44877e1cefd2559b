#include "solvers/stripe_point.h"

#include <cmath>
#include <utility>
#include <vector>

namespace crumple {
namespace {

constexpr int kMeetIterations = 30;
constexpr double kMeetTolerance_px = 1e-11;
constexpr double kLeastRate = 1e-3;  // px per doubling of depth

// Where the ray meets the plane that the light would be without distortion.
double depth_without_distortion(const ProbeRay& ray, const Sensor& projector, const Eigen::Vector2d& normal,
                                double coordinate_px) {
  const std::vector<double>& lens = projector.lens.parameters();
  const Eigen::Vector3d plane(normal.x() * lens[0], normal.y() * lens[1],
                              normal.x() * lens[2] + normal.y() * lens[3] - coordinate_px);
  return -plane.dot(projector.sensor_from_mount * ray.origin_mm) /
         plane.dot(projector.sensor_from_mount.rotation * ray.direction);
}

}  // namespace

Matrix3x6d ProbeRay::d_mount(double depth) const {
  Matrix3x6d d;
  d << to_camera.transpose() * cross_matrix(to_camera * at(depth)), -to_camera.transpose();
  return d;
}

std::optional<ProbeRay> probe_ray(const Sensor& camera, const Eigen::Vector2d& pixel, bool with_derivatives) {
  ProbeRay result;
  result.to_camera = camera.sensor_from_mount.rotation.toRotationMatrix();
  result.origin_mm = -(result.to_camera.transpose() * camera.sensor_from_mount.translation);
  if (with_derivatives) {
    auto ray = camera.lens.ray_with_gradients(pixel);
    if (!ray || !(ray->direction.z() == 1)) return std::nullopt;
    result.direction = result.to_camera.transpose() * ray->direction;
    result.d_lens = result.to_camera.transpose() * ray->d_parameters;
    return result;
  }
  const auto ray = camera.lens.ray(pixel);
  if (!ray || !(ray->z() == 1)) return std::nullopt;
  result.direction = result.to_camera.transpose() * *ray;
  return result;
}

std::optional<StripeCoordinate> stripe_coordinate(const Sensor& projector, const Eigen::Vector2d& normal,
                                                  const Eigen::Vector3d& in_probe) {
  const Pose& pose = projector.sensor_from_mount;
  const auto projection = projector.lens.project_with_gradients(pose * in_probe);
  if (!projection) return std::nullopt;
  StripeCoordinate result;
  const Eigen::RowVector3d d_in_projector = normal.transpose() * projection->d_point;
  result.value_px = normal.dot(projection->pixel);
  result.d_point = d_in_projector * pose.rotation.toRotationMatrix();
  result.d_lens = normal.transpose() * projection->d_parameters;
  result.d_mount = d_in_projector * d_transformed_d_pose(pose, in_probe);
  return result;
}

std::optional<StripePoint> stripe_point(const Sensor& camera, const Sensor& projector, const Eigen::Vector2d& normal,
                                        const Eigen::Vector2d& pixel, double coordinate_px, bool with_derivatives) {
  const auto ray = probe_ray(camera, pixel, with_derivatives);
  if (!ray) return std::nullopt;
  double depth = depth_without_distortion(*ray, projector, normal, coordinate_px);
  for (int i = 0; i < kMeetIterations; ++i) {
    if (!std::isfinite(depth) || depth <= 0) return std::nullopt;
    StripePoint point;
    point.in_probe = ray->at(depth);
    const auto met = stripe_coordinate(projector, normal, point.in_probe);
    if (!met) return std::nullopt;
    const double rate = met->d_point.dot(ray->direction);
    if (!(std::abs(rate) * depth > kLeastRate)) return std::nullopt;
    const double error = met->value_px - coordinate_px;
    if (std::abs(error) > kMeetTolerance_px && std::abs(error / rate) > 1e-14 * depth) {
      depth -= error / rate;
      continue;
    }
    if (!with_derivatives) return point;
    // At fixed depth first, then along the ray back into the light.
    point.d_coordinate = ray->direction / rate;
    const Eigen::Matrix3d into_light = Eigen::Matrix3d::Identity() - point.d_coordinate * met->d_point;
    point.d_camera_lens = depth * into_light * ray->d_lens;
    point.d_camera_mount = into_light * ray->d_mount(depth);
    point.d_projector_lens = -point.d_coordinate * met->d_lens;
    point.d_projector_mount = -point.d_coordinate * met->d_mount;
    return point;
  }
  return std::nullopt;
}

}  // namespace crumple
