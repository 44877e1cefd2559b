// ROS's camera_info as YAML (camera_calibration_parsers; sensor_msgs/CameraInfo): one file per camera, SENSOR.yaml.
//
//   image_width, image_height, camera_name
//   camera_matrix            K, 3 x 3
//   distortion_model         plumb_bob, with 5 terms k1 k2 t1 t2 k3, or rational_polynomial, with 8
//   distortion_coefficients  D
//   rectification_matrix     R, 3 x 3: x_in_rectified = R x_in_camera
//   projection_matrix        P, 3 x 4: of the rectified image; of the second camera of a pair P(0,3) = -fx B, B in m
//
// Holds LENSMODEL_PINHOLE, LENSMODEL_OPENCV4, 5 and 8 (the first two as plumb_bob with zeros, which come back as
// LENSMODEL_OPENCV5); no projectors. Poses it holds for two cameras only, in R and P of a rectified pair (OpenCV's
// stereoRectify; side by side or one above the other); with more cameras R is the identity and the poses are left
// behind. Reading gives the pose of a pair back: second_from_first = R2' (R1 x + P2(.,3) / f).
#pragma once

#include "datasets/formats/rig_format.h"

namespace crumple {

Expected<std::vector<std::string>> write_ros_rig(const RigToExport& source, const std::filesystem::path& folder);

// From one file, or from two: the first is the one whose P(.,3) is zero. Or from a folder with them.
Expected<Rig> read_ros_rig(const std::vector<std::filesystem::path>& inputs);

}  // namespace crumple
