// Streams of poses as text, one pose a line: t, x, y, z, qx, qy, qz, qw.
//
// t in seconds, x y z in metres, then a quaternion of unit length (to 1e-3), its sign free. A line maps the moving
// frame into the fixed one: x_in_fixed = R(q) x_in_moving + (x, y, z). Fields are separated by commas, blanks around
// them do not count. The first line may name the columns; it, and any line that starts with #, is passed over. Times
// must not decrease.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "solvers/expected.h"
#include "tracking/pose_stream.h"

namespace crumple {

// Fails, naming file and line, on anything else.
Expected<std::vector<StampedPose>> parse_pose_csv(const std::string& csv, const std::string& file_name);
Expected<PoseStream> read_pose_stream(const std::filesystem::path& file);

}  // namespace crumple
