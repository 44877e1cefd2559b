#include "tests/calib/fresh_stations.h"

#include <cmath>
#include <numbers>
#include <tuple>

#include "calib/calibrate.h"
#include "calib/measured_quantity.h"
#include "calib/station_poses.h"
#include "solvers/stripe_point.h"
#include "tracking/probe_pose.h"

namespace crumple {
namespace {

const Eigen::Vector2d kStripes = Eigen::Vector2d::UnitX();
constexpr double kSphereRadius_mm = 30;

struct TrueSurface {
  std::vector<Eigen::Vector3d> single;  // in the probe frame of their stations
  std::vector<std::size_t> station;
  std::vector<Eigen::Vector3d> sphere;  // at station 0
  Eigen::Vector3d sphere_centre;
};

// Two points 30 mm apart and one far from them at the first station, one at the second; a cap that the camera sees.
const TrueSurface& surface() {
  static const TrueSurface made = [] {
    TrueSurface s;
    s.single = {{-20, -35, 790}, {10, -35, 792}, {150, 80, 830}, {40, -60, 800}};
    s.station = {0, 0, 0, 1};
    s.sphere_centre = {60, 20, 800};
    for (int ring = 1; ring <= 5; ++ring) {
      for (int k = 0; k < 12; ++k) {
        const double polar = ring * 0.2, around = 2 * std::numbers::pi * (k + 0.5 * (ring % 2)) / 12;
        const Eigen::Vector3d outwards(std::sin(polar) * std::cos(around), std::sin(polar) * std::sin(around),
                                       -std::cos(polar));
        s.sphere.emplace_back(s.sphere_centre + kSphereRadius_mm * outwards);
      }
    }
    return s;
  }();
  return made;
}

double led_sigma_px(const BundleResult& found, std::size_t sensor, double otherwise) {
  for (const GroupSummary& group : found.groups) {
    if (group.sensor == sensor && group.kind == View::Kind::leds) return group.sigma_px;
  }
  return otherwise;
}

Expected<StationPoses> pose_stations(const FreshStations& stations, const Rig& rig, const BundleResult& found,
                                     std::mt19937_64& random) {
  Observations seen = stations.made.observations;
  add_noise(stations.noise, random, seen);
  StationPoses poses;
  for (std::size_t station = 0; station < stations.made.truth.world_from_probe.size(); ++station) {
    LedReadings readings;
    for (const LedView& view : seen.leds) {
      if (view.station != station) continue;
      const double sigma_px = led_sigma_px(found, view.sensor, stations.noise.led_px);
      readings.push_back(
          {view, std::vector<Eigen::Matrix2d>(view.leds.size(), sigma_px * sigma_px * Eigen::Matrix2d::Identity())});
    }
    const auto pose = probe_pose(rig, readings);
    if (!pose) return tl::unexpected(pose.error());
    LedReadings used;
    std::size_t next = 0;
    for (const LedReading& reading : readings) {
      LedReading kept{{reading.view.sensor, {}, {}, station}, {}};
      for (std::size_t i = 0; i < reading.view.leds.size(); ++i) {
        if (!pose->residuals[next++].used) continue;
        kept.view.leds.push_back(reading.view.leds[i]);
        kept.view.pixels.push_back(reading.view.pixels[i]);
        kept.covariances_px2.push_back(reading.covariances_px2[i]);
      }
      if (!kept.view.leds.empty()) used.push_back(std::move(kept));
    }
    const auto d_rig = d_pose_d_rig(rig, used, pose->world_from_probe);
    if (!d_rig) return tl::unexpected(d_rig.error());
    add_station({"station", pose->world_from_probe}, *d_rig, pose->covariance, poses);
    poses.views.push_back({station, 0, 1, {0}});
  }
  return poses;
}

// The point as it is measured, with its own part of the uncertainty.
Expected<CloudPoint> measured(const FreshStations& stations, const Rig& rig, const StationPoses& poses,
                              std::size_t station, const Eigen::Vector3d& in_probe, std::mt19937_64& random) {
  const std::vector<Sensor>& truth = stations.made.truth.rig.sensors;
  const auto pixel = truth[0].lens.project(truth[0].sensor_from_mount * in_probe);
  const auto coordinate = stripe_coordinate(truth[1], kStripes, in_probe);
  if (!pixel || !coordinate) return fail("a point is not seen");
  const double noise_px = stations.noise.stripe_px * std::normal_distribution<double>()(random);
  const auto point = stripe_point(rig.sensors[0], rig.sensors[1], kStripes, *pixel, coordinate->value_px + noise_px);
  if (!point) return fail("a point cannot be triangulated");
  const Pose& world_from_probe = poses.stations[station].world_from_probe;
  const Eigen::Vector3d along = world_from_probe.rotation * point->d_coordinate * stations.noise.stripe_px;
  CloudPoint result;
  result.position_mm = world_from_probe * point->in_probe;
  result.sigma_mm = static_cast<float>(along.norm());
  result.covariance_mm2 = (along * along.transpose()).cast<float>();
  result.station = static_cast<std::uint16_t>(station);
  result.view = static_cast<std::uint16_t>(station);
  result.quality = 1;
  return result;
}

MeasuredError of_length(const std::string& name, const MeasuredQuantity& length, double truth_mm) {
  const double sigma = length.budget.sigma();
  return {name, Eigen::VectorXd::Constant(1, length.value - truth_mm), Eigen::MatrixXd::Constant(1, 1, sigma * sigma)};
}

}  // namespace

FreshStations fresh_stations(MadeSystemOptions options) {
  FreshStations fresh;
  fresh.noise = {0, options.stripe_sigma_px, 0, options.led_sigma_px};
  options.stations = 0;
  options.wand_stations = 2;
  options.placements = 1;
  options.tracker_placements = 0;
  options.led_sigma_px = options.corner_sigma_px = options.stripe_sigma_px = 0;
  options.seed += 31;
  fresh.made = make_system(options);
  return fresh;
}

Expected<std::vector<MeasuredError>> measure_fresh(const FreshStations& stations, const BundleResult& found,
                                                   std::mt19937_64& random) {
  Rig rig = found.state.rig;
  rig.covariance = rig_covariance(found);
  const auto poses = pose_stations(stations, rig, found, random);
  if (!poses) return tl::unexpected(poses.error());
  const auto uncertainty = PointUncertainty::create(rig, *poses);
  if (!uncertainty) return tl::unexpected(uncertainty.error());
  Cloud cloud{"world", {"first", "second"}, {}};
  const TrueSurface& truth = surface();
  for (std::size_t i = 0; i < truth.single.size(); ++i) {
    const auto point = measured(stations, rig, *poses, truth.station[i], truth.single[i], random);
    if (!point) return tl::unexpected(point.error());
    cloud.points.push_back(*point);
  }
  std::vector<std::size_t> of_sphere;
  for (const Eigen::Vector3d& in_probe : truth.sphere) {
    const auto point = measured(stations, rig, *poses, 0, in_probe, random);
    if (!point) return tl::unexpected(point.error());
    of_sphere.push_back(cloud.points.size());
    cloud.points.push_back(*point);
  }
  const KnownCloud known(cloud, *uncertainty);
  const auto& true_poses = stations.made.truth.world_from_probe;
  std::vector<MeasuredError> errors;
  std::vector<MeasuredFeature> points;
  std::vector<Eigen::Vector3d> true_points;
  for (std::size_t i = 0; i < truth.single.size(); ++i) {
    auto point = measure_point(known, {i});
    if (!point) return tl::unexpected(point.error());
    true_points.emplace_back(true_poses[truth.station[i]] * truth.single[i]);
    const Eigen::MatrixXd covariance = point->by_rig * point->by_rig.transpose() +
                                       point->by_pose * poses->covariance * point->by_pose.transpose() +
                                       point->decoding;
    errors.push_back({"world point", point->values - true_points.back(), covariance});
    points.push_back(std::move(*point));
  }
  const std::tuple<const char*, std::size_t, std::size_t> pairs[] = {
      {"distance of 30 mm", 0, 1}, {"distance of 200 mm", 0, 2}, {"distance between stations", 1, 3}};
  for (const auto& [name, a, b] : pairs) {
    const auto length = distance(*uncertainty, points[a], points[b]);
    if (!length) return tl::unexpected(length.error());
    errors.push_back(of_length(name, *length, (true_points[a] - true_points[b]).norm()));
  }
  const auto sphere = measure_sphere(known, of_sphere);
  if (!sphere) return tl::unexpected(sphere.error());
  const Eigen::MatrixXd of_values = sphere->by_rig * sphere->by_rig.transpose() +
                                    sphere->by_pose * poses->covariance * sphere->by_pose.transpose() +
                                    sphere->decoding;
  errors.push_back({"sphere's centre", sphere->values.head<3>() - true_poses[0] * truth.sphere_centre,
                    of_values.topLeftCorner<3, 3>()});
  errors.push_back(of_length("sphere's radius", value_of(*uncertainty, *sphere, 3), kSphereRadius_mm));
  return errors;
}

}  // namespace crumple
