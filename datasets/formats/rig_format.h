// Rigs in the formats of other programs.
//
// A rig is written as files in a folder and read from files. What a format has no place for (a covariance, projectors,
// poses) is left behind and said; a lens that it cannot hold stops the export, and one that Crumple does not know stops
// the import: nothing is approximated. Pixel coordinates are converted where a format counts them otherwise.
//
//   opencv  SENSOR.yml each, cv::FileStorage: camera_matrix, distortion_coefficients, image_width, image_height, R, T
//   kalibr  camchain.yaml: pinhole cameras, each with its pose from the one before it; m
//   ros     SENSOR.yaml each, camera_info: of two cameras with the rectification that holds their pose; m
//   colmap  cameras.txt, rigs.txt, frames.txt, images.txt, points3D.txt: one frame of the rig; pixel centres at .5
//   mrcal   SENSOR.cameramodel each, with the inputs of the optimization where the rig's folder holds them
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "datasets/calibration_record.h"
#include "solvers/expected.h"
#include "solvers/rig.h"

namespace crumple {

struct RigToExport {
  Rig rig;
  std::optional<CalibrationRecord> record;  // what the rig was calibrated from, where its folder holds that
  double mm_per_unit = 1;                   // of the lengths written, in formats that state no unit
};

struct RigFormat {
  std::string name;
  std::string lengths;  // the unit the format states, "m"; empty where it states none
  // Writes into an existing folder; what was left behind, in words.
  Expected<std::vector<std::string>> (*write)(const RigToExport&, const std::filesystem::path& folder);
  // Files, or one folder with them. Lengths of formats that state no unit are taken as they are.
  Expected<Rig> (*read)(const std::vector<std::filesystem::path>& inputs);
};

const std::vector<RigFormat>& rig_formats();

// Fails with the names there are.
Expected<RigFormat> rig_format(const std::string& name);

// The rig with every translation multiplied by `factor`.
Rig scaled(Rig rig, double factor);

}  // namespace crumple
