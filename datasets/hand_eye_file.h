// A hand-eye calibration on disk: hand_eye.yaml and, beside it, covariance.npy.
//
//   schema: crumple-hand-eye/1
//   hand_from_eye, world_from_board: poses
//   time_offset_s: hand time = eye time + offset; not of pairs without times
//   covariance: file, and the names of its rows
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "solvers/expected.h"
#include "tracking/hand_eye_refinement.h"

namespace crumple {

// Of the covariance that is written: "hand_from_eye.rotation_x", ..., "world_from_board.translation_z" and, where there
// is one, "time_offset".
std::vector<std::string> hand_eye_rows(bool timed);

// Numbers are read back exactly.
Expected<void> write_hand_eye(const std::filesystem::path& folder, const HandEyeFit& fit);

}  // namespace crumple
