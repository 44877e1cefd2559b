// OpenCV's YAML: one file per sensor, SENSOR.yml, readable by cv::FileStorage under the names of OpenCV's own
// calibration programs.
//
//   image_width, image_height
//   camera_matrix             3 x 3
//   distortion_coefficients   n x 1: k1 k2 p1 p2 k3 k4 k5 k6 s1 s2 s3 s4; none where the lens has none
//   R, T                      x_in_sensor = R x_in_reference + T; the reference is the rig's first camera
//   sensor_kind               camera or projector
//
// Holds LENSMODEL_PINHOLE and LENSMODEL_OPENCV4, 5, 8, 12; projectors as well. States no unit of length. On reading, R,
// T and sensor_kind may be missing: a camera at the reference, which only the first may be.
#pragma once

#include "datasets/formats/rig_format.h"

namespace crumple {

Expected<std::vector<std::string>> write_opencv_rig(const RigToExport& source, const std::filesystem::path& folder);

// From files, the first being the reference; or from a folder, where the sensor whose pose is the identity is.
Expected<Rig> read_opencv_rig(const std::vector<std::filesystem::path>& inputs);

}  // namespace crumple
