#include "datasets/near_poses.h"

#include <algorithm>

#include <fmt/format.h>

#include "datasets/stations_file.h"

namespace crumple {

Expected<NearPoses> NearPoses::create(const std::string& statement) {
  NearPoses near;
  near.previous_ = statement == "previous";
  if (statement.empty() || near.previous_) return near;
  const std::filesystem::path named = statement;
  near.file_ = std::filesystem::is_directory(named) ? named / "stations.yaml" : named;
  auto stated = read_posed_stations(*near.file_);
  if (!stated) return tl::unexpected(stated.error());
  near.stated_ = std::move(*stated);
  return near;
}

std::optional<NearPose> NearPoses::at(const std::string& station) const {
  if (previous_) return last_;
  const auto found =
      std::find_if(stated_.begin(), stated_.end(), [&](const PosedStation& s) { return s.name == station; });
  if (found == stated_.end()) return std::nullopt;
  return NearPose{found->world_from_probe, fmt::format("{} of {}", station, file_->string())};
}

Expected<StationPose> NearPoses::pose(const Capture& capture, const Rig& rig, const std::string& station) {
  auto found = station_pose(capture, rig, station, PoseMethod::pixels, at(station));
  if (found) posed(station, *found);
  return found;
}

void NearPoses::posed(const std::string& station, const StationPose& where) {
  const ProbePose& pose = where.constellation.pose;
  if (previous_ && !pose.choice) last_ = NearPose{pose.world_from_probe, "station " + station};
}

}  // namespace crumple
