// Roughly how the probe stood at stations whose LEDs leave several poses: what a user states, one entry a station, or
// that each station is near the one before it.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "calib/station_poses.h"
#include "datasets/station_pose.h"

namespace crumple {

class NearPoses {
 public:
  // Nothing is stated.
  NearPoses() = default;

  // `statement` is the word `previous`, or names a stations.yaml (datasets/stations_file.h) or the folder that holds
  // one; empty: nothing. Fails where the file cannot be read.
  static Expected<NearPoses> create(const std::string& statement);

  // station_pose() with what is known of the station. With `previous` that is the last station before it, in the order
  // of the calls, whose pose its own LEDs told: one that was taken for being near another tells nothing further.
  Expected<StationPose> pose(const Capture& capture, const Rig& rig, const std::string& station);

  // That a station was posed elsewhere.
  void posed(const std::string& station, const StationPose& where);

  // The file it was read from; none where there is none.
  const std::optional<std::filesystem::path>& file() const { return file_; }

 private:
  std::optional<NearPose> at(const std::string& station) const;

  bool previous_ = false;
  std::optional<std::filesystem::path> file_;
  std::vector<PosedStation> stated_;
  std::optional<NearPose> last_;
};

}  // namespace crumple
