// Where the stations of a cloud were, on disk beside it, so that its uncertainty can be computed years later:
//   stations.yaml            schema crumple-stations/1: stations with their poses, views, names of the other files
//   stations_d_rig.npy       how the poses depend on the rig (calib/station_poses.h)
//   stations_covariance.npy  what the rig does not explain of them
// The rig they refer to is in rig/ beside them (datasets/rig_file.h).
#pragma once

#include <filesystem>
#include <optional>
#include <vector>

#include "calib/station_poses.h"
#include "solvers/rig.h"

namespace crumple {

// Into an existing folder, with the rig.
Expected<void> write_stations(const std::filesystem::path& folder, const Rig& rig, const StationPoses& poses);

struct StationsAndRig {
  Rig rig;
  StationPoses poses;
};

// The poses alone of stations.yaml; the files beside it are not read. Fails on a file that is missing or damaged, and
// where two stations have one id.
Expected<std::vector<PosedStation>> read_posed_stations(const std::filesystem::path& file);

// The rig that the poses of stations.yaml were found with: none where what is written with it is not beside it. Fails
// on a damaged one.
Expected<std::optional<Rig>> read_rig_of_stations(const std::filesystem::path& file);

// Fails, naming file, line and key, on a missing or damaged file, on views of stations and sensors that there are not,
// and on matrices that do not fit stations and rig.
Expected<StationsAndRig> read_stations(const std::filesystem::path& folder);

}  // namespace crumple
