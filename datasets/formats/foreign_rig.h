// What the formats of other programs have in common: OpenCV's camera matrix and distortion, rotations as matrices, a
// rig made of cameras whose poses are known in some frame, and the sentences about what does not fit.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include <Eigen/Core>
#include <opencv2/core/mat.hpp>

#include "solvers/expected.h"
#include "solvers/rig.h"

namespace crumple {

constexpr double kMmPerM = 1000;

// A lens of OpenCV's family, by its camera matrix and its terms k1 k2 p1 p2 k3 ...; 0, 4, 5, 8 or 12 of them, or 14 of
// which the last two (a tilted sensor) are zero. Fails on skew and other counts.
Expected<Lens> lens_from_opencv(ImageSize size, const Eigen::Matrix3d& camera_matrix, std::vector<double> terms);

// LENSMODEL_PINHOLE or LENSMODEL_OPENCV4, 5, 8, 12.
bool is_opencv_lens(const Lens& lens);
Eigen::Matrix3d camera_matrix(const Lens& lens);
std::vector<double> distortion_terms(const Lens& lens);

cv::Mat to_mat(const Eigen::MatrixXd& matrix);

// The pose of a rotation matrix that may be rounded: fails where it is off a rotation by more than 1e-4.
Expected<Pose> pose_from_matrix(const Eigen::Matrix3d& rotation, const Eigen::Vector3d& translation);

// A format's reader has sensors in some common frame: the first becomes the reference. Fails, naming the sensor, on a
// number or an image size beyond what rig.yaml holds.
Expected<Rig> rig_from_sensors(std::vector<Sensor> sensors);

// Whether it is a camera in the frame the poses refer to.
bool is_at_reference(const Sensor& sensor);

std::vector<Sensor> cameras_of(const Rig& rig);

// Why this lens stops the export. `holds`: what the format can hold, such as "LENSMODEL_PINHOLE and LENSMODEL_OPENCV4".
tl::unexpected<Error> lens_refused(const Sensor& sensor, const std::string& format, const std::string& holds);

// What no other program's format holds of a rig, and the projectors where `projectors` is false.
std::vector<std::string> left_behind(const Rig& rig, bool projectors);

// The files named, or those with this extension in the one folder named, by name.
Expected<std::vector<std::filesystem::path>> files_named(const std::vector<std::filesystem::path>& inputs,
                                                         const std::string& extension);

// A sensor name made of any text: what cannot be in one becomes _.
std::string plain_name(const std::string& text);

// A number as YAML 1.1 readers take it too, which want a point in it: 1.0e-07. It reads back exactly.
std::string yaml_number(double value);
std::string yaml_numbers(const std::vector<double>& values);

}  // namespace crumple
