// What `crumple track` says of the stations: poses.csv, summary.json (docs/formats.md) and a page of text. Of stations
// that markers posed there is no covariance, nor what follows from it.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "datasets/station_pose.h"

namespace crumple {

struct TrackedStation {
  std::string station;
  Expected<StationPose> found;
  std::optional<Matrix6d> by_rig = {};  // of the pose, from the rig's covariance; none where that is not known
};

nlohmann::json track_summary(const Rig& rig, const std::vector<TrackedStation>& stations, PoseMethod method);
std::string track_text(const std::vector<TrackedStation>& stations, PoseMethod method);

// station, x_mm, y_mm, z_mm, qx, qy, qz, qw and the upper triangle of the pose's covariance, rows rotation x y z (rad),
// then translation x y z (mm): world_from_probe of those that were found.
std::string poses_csv(const std::vector<TrackedStation>& stations, PoseMethod method);

}  // namespace crumple
