#include "tracking/pose_starts.h"

#include <algorithm>
#include <array>
#include <map>

#include <opencv2/calib3d.hpp>

#include "solvers/closed_form/plane.h"
#include "solvers/closed_form/rigid_fit.h"
#include "solvers/closed_form/triangulate.h"

namespace crumple {
namespace {

struct WorldPoint {
  Eigen::Vector3d in_probe;
  Eigen::Vector3d in_world;
};

// What one tracker sees, as OpenCV takes it: the camera that has undistorted rays for pixels.
struct RaysOfTracker {
  Pose sensor_from_world;
  std::vector<Eigen::Vector3d> leds_mm;
  std::vector<cv::Point3d> objects;
  std::vector<cv::Point2d> images;
};

std::vector<WorldPoint> shared_leds(const std::vector<LedSighting>& sightings) {
  struct Rays {
    Eigen::Vector3d led_mm;
    std::vector<Eigen::Vector3d> origins, directions;
  };
  std::map<std::size_t, Rays> of_led;
  for (const LedSighting& s : sightings) {
    const auto ray = s.lens->ray(s.pixel);
    if (!ray) continue;
    const Eigen::Quaterniond world_from_sensor = s.sensor_from_world.rotation.conjugate();
    Rays& rays = of_led[s.led];
    rays.led_mm = s.led_mm;
    rays.origins.push_back(-(world_from_sensor * s.sensor_from_world.translation));
    rays.directions.push_back((world_from_sensor * *ray).normalized());
  }
  std::vector<WorldPoint> points;
  for (const auto& [led, rays] : of_led) {
    if (rays.origins.size() < 2) continue;
    if (const auto point = nearest_to_rays(rays.origins, rays.directions)) points.push_back({rays.led_mm, *point});
  }
  return points;
}

std::vector<RaysOfTracker> rays_of_trackers(const std::vector<LedSighting>& sightings) {
  std::map<std::size_t, RaysOfTracker> of_sensor;
  for (const LedSighting& s : sightings) {
    const auto ray = s.lens->ray(s.pixel);
    if (!ray || ray->z() <= 0) continue;
    RaysOfTracker& rays = of_sensor[s.sensor];
    rays.sensor_from_world = s.sensor_from_world;
    rays.leds_mm.push_back(s.led_mm);
    rays.objects.emplace_back(s.led_mm.x(), s.led_mm.y(), s.led_mm.z());
    rays.images.emplace_back(ray->x() / ray->z(), ray->y() / ray->z());
  }
  std::vector<RaysOfTracker> result;
  for (const auto& [sensor, rays] : of_sensor) {
    if (rays.objects.size() >= 3) result.push_back(rays);
  }
  // Where there are more LEDs there is less to confuse.
  std::stable_sort(result.begin(), result.end(),
                   [](const RaysOfTracker& a, const RaysOfTracker& b) { return a.objects.size() > b.objects.size(); });
  return result;
}

// OpenCV throws where it cannot: that is no pose then.
std::vector<Pose> opencv_poses(const RaysOfTracker& rays, int method) {
  std::vector<cv::Mat> rotations, translations;
  try {
    if (method == cv::SOLVEPNP_AP3P) {
      cv::solveP3P(rays.objects, rays.images, cv::Matx33d::eye(), cv::noArray(), rotations, translations, method);
    } else {
      cv::solvePnPGeneric(rays.objects, rays.images, cv::Matx33d::eye(), cv::noArray(), rotations, translations, false,
                          static_cast<cv::SolvePnPMethod>(method));
    }
  } catch (const cv::Exception&) {
    return {};
  }
  std::vector<Pose> poses;
  for (std::size_t i = 0; i < rotations.size(); ++i) {
    const double* r = rotations[i].ptr<double>();
    const double* t = translations[i].ptr<double>();
    const Pose sensor_from_probe{rotation_from_vector({r[0], r[1], r[2]}), {t[0], t[1], t[2]}};
    if (!sensor_from_probe.translation.allFinite() || !sensor_from_probe.rotation.coeffs().allFinite()) continue;
    poses.push_back(rays.sensor_from_world.inverse() * sensor_from_probe);
  }
  return poses;
}

// Triples (i, j, k) of n, every so many, so that no more than `most` come.
std::vector<std::array<std::size_t, 3>> even_triples(std::size_t n, std::size_t most) {
  const std::size_t all = n * (n - 1) * (n - 2) / 6, step = std::max<std::size_t>(1, (all + most - 1) / most);
  std::vector<std::array<std::size_t, 3>> triples;
  std::size_t count = 0;
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t j = i + 1; j < n; ++j) {
      for (std::size_t k = j + 1; k < n; ++k) {
        if (count++ % step == 0) triples.push_back({i, j, k});
      }
    }
  }
  return triples;
}

void append(std::vector<Pose>& all, const std::vector<Pose>& more) { all.insert(all.end(), more.begin(), more.end()); }

}  // namespace

std::vector<Pose> quick_starts(const std::vector<LedSighting>& sightings) {
  std::vector<Eigen::Vector3d> in_probe, in_world;
  for (const WorldPoint& point : shared_leds(sightings)) {
    in_probe.push_back(point.in_probe);
    in_world.push_back(point.in_world);
  }
  std::vector<Pose> starts;
  if (const auto pose = rigid_fit(in_probe, in_world)) starts.push_back(*pose);
  if (!starts.empty()) return starts;
  for (const RaysOfTracker& rays : rays_of_trackers(sightings)) {
    append(starts, opencv_poses(rays, rays.objects.size() == 3 ? cv::SOLVEPNP_AP3P : cv::SOLVEPNP_SQPNP));
  }
  return starts;
}

std::vector<Pose> triple_starts(const std::vector<LedSighting>& sightings, std::size_t most) {
  std::vector<Pose> starts;
  const std::vector<WorldPoint> points = shared_leds(sightings);
  if (points.size() >= 3) {
    for (const auto& [i, j, k] : even_triples(points.size(), most)) {
      const auto pose = rigid_fit({points[i].in_probe, points[j].in_probe, points[k].in_probe},
                                  {points[i].in_world, points[j].in_world, points[k].in_world});
      if (pose) starts.push_back(*pose);
    }
  }
  for (const RaysOfTracker& rays : rays_of_trackers(sightings)) {
    for (const auto& [i, j, k] : even_triples(rays.objects.size(), most)) {
      if (!fit_plane({rays.leds_mm[i], rays.leds_mm[j], rays.leds_mm[k]})) continue;
      append(starts, opencv_poses({.sensor_from_world = rays.sensor_from_world,
                                   .leds_mm = {},
                                   .objects = {rays.objects[i], rays.objects[j], rays.objects[k]},
                                   .images = {rays.images[i], rays.images[j], rays.images[k]}},
                                  cv::SOLVEPNP_AP3P));
    }
  }
  return starts;
}

std::vector<Pose> mirrored(const std::vector<LedSighting>& sightings, const Pose& world_from_probe) {
  std::vector<Pose> result;
  for (const RaysOfTracker& rays : rays_of_trackers(sightings)) {
    const auto plane = fit_plane(rays.leds_mm);
    if (!plane) continue;
    Eigen::Vector3d centroid = Eigen::Vector3d::Zero();
    for (const Eigen::Vector3d& led : rays.leds_mm) centroid += led / static_cast<double>(rays.leds_mm.size());
    const Pose sensor_from_probe = rays.sensor_from_world * world_from_probe;
    const Eigen::Vector3d middle = sensor_from_probe * centroid, sight = middle.normalized();
    const Eigen::Vector3d normal = sensor_from_probe.rotation * plane->normal;
    const Eigen::Matrix3d one = Eigen::Matrix3d::Identity();
    const Eigen::Matrix3d turn = (one - 2 * sight * sight.transpose()) * (one - 2 * normal * normal.transpose());
    const Eigen::Quaterniond rotation(Eigen::Matrix3d(turn * sensor_from_probe.rotation.toRotationMatrix()));
    result.push_back(rays.sensor_from_world.inverse() * Pose{rotation, middle - rotation * centroid});
  }
  return result;
}

}  // namespace crumple
