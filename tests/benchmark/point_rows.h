// What the covariance of many points of a cloud costs: of one view, and of as many that were merged of three.
#pragma once

#include <algorithm>
#include <limits>
#include <random>
#include <vector>

#include <fmt/format.h>

#include "calib/point_uncertainty.h"
#include "tests/benchmark/report.h"
#include "tests/calib/tracked_probe.h"

namespace crumple {

inline Cloud made_cloud(const StationPoses& poses, int points, bool merged) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> uniform(-1, 1);
  Cloud cloud{"world", {"station", "station"}, {}};
  for (int i = 0; i < points; ++i) {
    const double x = 90 * uniform(random), y = 70 * uniform(random), z = 800 + 40 * uniform(random);
    CloudPoint point;
    point.position_mm = poses.stations[0].world_from_probe * Eigen::Vector3d(x, y, z);
    cloud.points.push_back(point);
    if (!merged) continue;
    // The stations of the views may be the same: the work is that of three.
    for (const int view : {0, 2, 3}) {
      cloud.shares.push_back({static_cast<std::uint32_t>(i), static_cast<std::uint16_t>(view), 1.0F / 3});
    }
  }
  return cloud;
}

// The best time of so many turns.
inline std::vector<BenchRow> point_rows(int points, int turns, int threads) {
  TrackedProbe probe;
  Eigen::VectorXd sigma(probe.size());
  for (Eigen::Index i = 0; i < sigma.size(); ++i) sigma[i] = probe.scale_of(static_cast<std::size_t>(i));
  probe.truth.rig.covariance.matrix = Eigen::MatrixXd(sigma.cwiseAbs2().asDiagonal());
  StationPoses poses = probe.poses(probe.truth.rig, probe.readings);
  poses.views.push_back({0, 0, 1, {0}});
  poses.views.push_back({0, 0, 1, {0}});
  const PointUncertainty known = PointUncertainty::create(probe.truth.rig, poses).value();
  std::vector<BenchRow> rows;
  for (const bool merged : {false, true}) {
    const Cloud cloud = made_cloud(poses, points, merged);
    BenchRow row{fmt::format("covariance of {} points{}, {} parameters, {} threads", points,
                             merged ? " merged of three views" : "", known.variables(), threads),
                 "", std::numeric_limits<double>::infinity(), 0};
    for (int turn = 0; turn < turns; ++turn) {
      row.ours_s = std::min(row.ours_s, seconds_of([&] { known.parts(cloud, threads).value(); }));
    }
    rows.push_back(row);
  }
  return rows;
}

}  // namespace crumple
