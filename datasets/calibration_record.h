// What a rig was calibrated from, as its folder holds it: the boards and their placements (placements.yaml) and the
// corners seen on them (residuals.csv).
#pragma once

#include <filesystem>
#include <optional>
#include <vector>

#include "datasets/placements_file.h"
#include "datasets/residuals_file.h"
#include "solvers/expected.h"

namespace crumple {

struct CalibrationRecord {
  Placements placements;
  std::vector<RecordedCorners> corners;
};

// None where the folder has no placements.yaml: the rig was imported, or written by Crumple before it kept them. Fails
// on a damaged file, and where a corner is of a placement or a marked point that there is not.
Expected<std::optional<CalibrationRecord>> read_calibration_record(const std::filesystem::path& rig_folder);

}  // namespace crumple
