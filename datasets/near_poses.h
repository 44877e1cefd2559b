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
  //
  // What is stated must be in the world frame of `rig`, that of its first tracker. The rig that a run wrote beside the
  // file is held against it: fails where its first tracker is another, and where a tracker of both stands turned by
  // more than 1 deg or shifted by more than 30 mm. One calibration differs from the next by far less, a tracker that
  // was put elsewhere by far more; and a third of the turn between two poses, which decides, hardly notices 1 deg.
  // Trackers that were all moved as one, or a single one, do not show. Where nothing could be compared the source of a
  // pose says so.
  static Expected<NearPoses> create(const std::string& statement, const Rig& rig);

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
  std::string unchecked_;  // why nothing says whether its frame is this one; empty: it was compared
  std::vector<PosedStation> stated_;
  std::optional<NearPose> last_;
};

}  // namespace crumple
