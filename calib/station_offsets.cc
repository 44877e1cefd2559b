#include "calib/station_offsets.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "calib/point_shares.h"

namespace crumple {
namespace {

constexpr std::size_t kLookedAt = 500;  // points for each station

// Weights that sum to one.
std::vector<CloudShare> normalised(std::vector<CloudShare> shares) {
  double sum = 0;
  for (const CloudShare& share : shares) sum += share.weight;
  for (CloudShare& share : shares) share.weight = static_cast<float>(share.weight / sum);
  return shares;
}

// Sums over points of how the station and the rest move apart.
struct Apart {
  Eigen::RowVectorXd by_rig;
  Eigen::RowVectorXd by_poses;
  std::size_t points = 0;

  void add(const Eigen::RowVector3d& normal, const PointSensitivity& of, double sign) {
    by_rig += sign * normal * of.by_rig;
    for (const StationSensitivity& station : of.by_station) {
      by_poses.segment<6>(6 * static_cast<Eigen::Index>(station.station)) += sign * normal * station.d_pose;
    }
  }
};

}  // namespace

std::vector<StationOffset> station_offsets(const Cloud& cloud, const PointUncertainty& uncertainty) {
  const StationPoses& poses = uncertainty.poses();
  const std::size_t stations = poses.stations.size();
  const auto six = 6 * static_cast<Eigen::Index>(stations);
  std::vector<Apart> apart(stations,
                           {Eigen::RowVectorXd::Zero(uncertainty.variables()), Eigen::RowVectorXd::Zero(six), 0});
  const PointShares shares(cloud);
  const std::size_t stride =
      std::max<std::size_t>(1, cloud.points.size() / (kLookedAt * std::max<std::size_t>(1, stations)));
  CloudShare room;
  PointSensitivity own, rest;
  for (std::size_t i = 0; i < cloud.points.size(); i += stride) {
    const auto of_point = shares.of(i, room);
    std::set<std::size_t> seen_from;
    for (const CloudShare& share : of_point) seen_from.insert(poses.views[share.view].station);
    if (seen_from.size() < 2) continue;
    const CloudPoint& point = cloud.points[i];
    for (const std::size_t station : seen_from) {
      std::vector<CloudShare> of_station, of_rest;
      for (const CloudShare& share : of_point) {
        (poses.views[share.view].station == station ? of_station : of_rest).push_back(share);
      }
      if (!uncertainty.sensitivity(point.position_mm, normalised(of_station), own) ||
          !uncertainty.sensitivity(point.position_mm, normalised(of_rest), rest)) {
        continue;
      }
      const Eigen::RowVector3d normal = point.normal.cast<double>();
      apart[station].add(normal, own, 1);
      apart[station].add(normal, rest, -1);
      ++apart[station].points;
    }
  }
  std::vector<StationOffset> offsets(stations);
  for (std::size_t s = 0; s < stations; ++s) {
    offsets[s].points = apart[s].points;
    if (apart[s].points == 0) continue;
    const double by_poses = apart[s].by_poses * poses.covariance * apart[s].by_poses.transpose();
    offsets[s].sigma_mm =
        std::sqrt(apart[s].by_rig.squaredNorm() + std::max(0.0, by_poses)) / static_cast<double>(apart[s].points);
  }
  return offsets;
}

}  // namespace crumple
