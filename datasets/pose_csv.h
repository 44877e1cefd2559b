// Poses as text, one a line: t, x, y, z, qx, qy, qz, qw.
//
// t in seconds, x y z in metres, then a quaternion of unit length (to 1e-3), its sign free. A line maps the moving
// frame into the fixed one: x_in_fixed = R(q) x_in_moving + (x, y, z). Fields are separated by commas, blanks around
// them do not count. The first line may name the columns; it, and any line that starts with #, is passed over. Of a
// stream times must not decrease; of a list, whose poses belong to those of another list by their order, t may be any
// number and says nothing.
//
// poses.csv of `crumple track` is a list too, known by its first line. It is in mm and has no times.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "solvers/expected.h"
#include "solvers/pose.h"
#include "tracking/pose_stream.h"

namespace crumple {

// How the first line of poses.csv starts (docs/formats.md); behind these columns may be the poses' covariances.
inline constexpr const char* kStationPoseColumns = "station,x_mm,y_mm,z_mm,qx,qy,qz,qw";

// Streams. Fail, naming file and line, on anything else.
Expected<std::vector<StampedPose>> parse_pose_csv(const std::string& csv, const std::string& file_name);
Expected<PoseStream> read_pose_stream(const std::filesystem::path& file);

// Lists, in the order of their lines; of poses.csv the poses alone. Fail, naming file and line, on anything else.
Expected<std::vector<Pose>> parse_pose_list(const std::string& csv, const std::string& file_name);
Expected<std::vector<Pose>> read_pose_list(const std::filesystem::path& file);

}  // namespace crumple
