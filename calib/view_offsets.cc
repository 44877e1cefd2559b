#include "calib/view_offsets.h"

#include <algorithm>
#include <cmath>

#include "calib/point_shares.h"

namespace crumple {
namespace {

constexpr std::size_t kLookedAt = 500;  // points for each view

// Weights that sum to one.
std::vector<CloudShare> normalised(std::vector<CloudShare> shares) {
  double sum = 0;
  for (const CloudShare& share : shares) sum += share.weight;
  for (CloudShare& share : shares) share.weight = static_cast<float>(share.weight / sum);
  return shares;
}

// Sums over points of how a view and the earlier ones move apart.
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

// Of every view the points that it shares with earlier ones.
std::vector<std::vector<std::size_t>> shared_points(const Cloud& cloud, const PointShares& shares, std::size_t views) {
  std::vector<std::vector<std::size_t>> points(views);
  CloudShare room;
  for (std::size_t i = 0; i < cloud.points.size(); ++i) {
    const auto of_point = shares.of(i, room);
    const auto first = std::min_element(of_point.begin(), of_point.end(),
                                        [](const CloudShare& a, const CloudShare& b) { return a.view < b.view; });
    for (const CloudShare& share : of_point) {
      if (share.view != first->view) points[share.view].push_back(i);
    }
  }
  return points;
}

}  // namespace

std::vector<ViewOffset> view_offsets(const Cloud& cloud, const PointUncertainty& uncertainty) {
  const StationPoses& poses = uncertainty.poses();
  const PointShares shares(cloud);
  const auto shared = shared_points(cloud, shares, poses.views.size());
  std::vector<ViewOffset> offsets(poses.views.size());
  CloudShare room;
  PointSensitivity own, earlier;
  for (std::size_t view = 0; view < offsets.size(); ++view) {
    Apart apart{Eigen::RowVectorXd::Zero(uncertainty.variables()), Eigen::RowVectorXd::Zero(poses.covariance.rows()),
                0};
    const std::size_t stride = std::max<std::size_t>(1, shared[view].size() / kLookedAt);
    for (std::size_t k = 0; k < shared[view].size(); k += stride) {
      const CloudPoint& point = cloud.points[shared[view][k]];
      std::vector<CloudShare> of_view, of_earlier;
      for (const CloudShare& share : shares.of(shared[view][k], room)) {
        if (share.view == view) of_view.push_back(share);
        if (share.view < view) of_earlier.push_back(share);
      }
      if (!uncertainty.sensitivity(point.position_mm, normalised(of_view), own) ||
          !uncertainty.sensitivity(point.position_mm, normalised(of_earlier), earlier)) {
        continue;
      }
      const Eigen::RowVector3d normal = point.normal.cast<double>();
      apart.add(normal, own, 1);
      apart.add(normal, earlier, -1);
      ++apart.points;
    }
    if (apart.points == 0) continue;
    const double by_poses = apart.by_poses * poses.covariance * apart.by_poses.transpose();
    const double sum = std::sqrt(apart.by_rig.squaredNorm() + std::max(0.0, by_poses));
    offsets[view] = {apart.points, sum / static_cast<double>(apart.points)};
  }
  return offsets;
}

}  // namespace crumple
