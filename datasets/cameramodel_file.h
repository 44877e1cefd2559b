// mrcal's .cameramodel files: one lens and its pose.
#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "solvers/expected.h"
#include "solvers/lens.h"
#include "solvers/pose.h"

namespace crumple {

// What mrcal calls optimization_inputs: the problem that the model solves, for its tools to take up.
struct OptimizationInputs {
  std::string base85;  // an .npz with the arguments of mrcal.optimize()
  int camera = 0;      // which of the problem's cameras the model is
};

struct CameraModel {
  Lens lens;
  Pose camera_from_reference;                     // `extrinsics` in the file: rotation vector (rad), translation (mm)
  std::optional<OptimizationInputs> inputs = {};  // written where set; not read
};

// Numbers carry as many digits as it takes to read them back exactly; the rotation goes through a rotation vector and
// comes back to rounding only. mrcal knows no unit of length: whatever the file holds is taken as mm, and ours says so
// in a comment; `unit` is for models that are written in another one.
std::string cameramodel_text(const CameraModel& model, const std::string& unit = "mm");
Expected<CameraModel> parse_cameramodel(const std::string& text);

Expected<void> write_cameramodel(const std::filesystem::path& file, const CameraModel& model);
// Fails on a missing file or key, a number that is not finite or beyond 1e12, and a lens model that Lens does not know,
// naming the file and the key. Keys that do not matter here (valid_intrinsics_region, optimization_inputs) are ignored.
Expected<CameraModel> read_cameramodel(const std::filesystem::path& file);

}  // namespace crumple
