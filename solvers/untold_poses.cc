#include "solvers/untold_poses.h"

#include <algorithm>
#include <map>

#include "solvers/closed_form/board_pose.h"

namespace crumple {
namespace {

constexpr int kLeastForPose = 6;  // coordinates

std::set<BlockId> untold_poses(const std::vector<std::unique_ptr<View>>& views,
                               const std::vector<ViewWeights>& weights) {
  std::map<BlockId, int> accepted;  // coordinates
  for (std::size_t v = 0; v < views.size(); ++v) {
    const auto& inlier = weights[v].inlier;
    const auto inliers = std::count_if(inlier.begin(), inlier.end(), [](char c) { return c != 0; });
    for (const BlockId& block : views[v]->blocks()) {
      if (block.is_pose()) accepted[block] += views[v]->dimension() * static_cast<int>(inliers);
    }
  }
  std::set<BlockId> untold;
  for (const auto& [pose, coordinates] : accepted) {
    if (coordinates < kLeastForPose) untold.insert(pose);
  }
  return untold;
}

// From the corners that one sensor sees of it, where one sees enough.
void pose_anew(std::size_t placement, const Observations& observations, CalibrationState& state) {
  for (const CornerView& view : observations.corners) {
    if (view.placement != placement) continue;
    const Sensor& sensor = state.rig.sensors[view.sensor];
    Points2d plane;
    for (const int corner : view.corners) plane.emplace_back(state.board_at(placement).point(corner).head<2>());
    const auto pose = board_pose(sensor.lens, plane, view.pixels);
    if (!pose) continue;
    const Pose mount_from_board = sensor.sensor_from_mount.inverse() * *pose;
    state.world_from_board[placement] =
        view.station ? state.world_from_probe[*view.station] * mount_from_board : mount_from_board;
    return;
  }
}

}  // namespace

bool settle_untold_poses(const std::vector<std::unique_ptr<View>>& views, const Observations& observations,
                         bool try_again, std::vector<ViewWeights>& weights, CalibrationState& state,
                         std::set<BlockId>& held) {
  const std::set<BlockId> untold = untold_poses(views, weights);
  for (std::size_t v = 0; v < views.size(); ++v) {
    const auto& blocks = views[v]->blocks();
    if (std::none_of(blocks.begin(), blocks.end(), [&](const BlockId& b) { return untold.contains(b); })) continue;
    std::fill(weights[v].inlier.begin(), weights[v].inlier.end(), try_again);
  }
  if (try_again) {
    for (const BlockId& pose : untold) {
      if (pose.kind == BlockId::Kind::placement) pose_anew(pose.index, observations, state);
    }
    return !untold.empty();
  }
  bool changed = false;
  for (const BlockId& pose : untold) changed = held.insert(pose).second || changed;
  return changed;
}

}  // namespace crumple
