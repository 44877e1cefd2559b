#include "datasets/formats/ros_rig.h"

#include <algorithm>

#include <fmt/format.h>
#include <opencv2/calib3d.hpp>
#include <opencv2/core/eigen.hpp>

#include "datasets/formats/foreign_rig.h"
#include "datasets/formats/yaml_matrix.h"
#include "datasets/limits.h"
#include "datasets/output_folder.h"
#include "datasets/yaml_reader.h"

namespace crumple {
namespace {

namespace fs = std::filesystem;

using Matrix34 = Eigen::Matrix<double, 3, 4>;

// R and P of one camera. P's last column is in px m.
struct Rectification {
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
  Matrix34 projection = Matrix34::Zero();
};

Rectification unrectified(const Lens& lens) {
  Rectification result;
  result.projection.leftCols<3>() = camera_matrix(lens);
  return result;
}

cv::Mat terms_mat(const Lens& lens) {
  std::vector<double> terms = distortion_terms(lens);
  if (terms.empty()) terms.resize(4);
  return cv::Mat(terms, true);
}

Rectification from_mats(const cv::Mat& rotation, const cv::Mat& projection) {
  Rectification result;
  cv::cv2eigen(rotation, result.rotation);
  cv::cv2eigen(projection, result.projection);
  result.projection.col(3) /= kMmPerM;
  return result;
}

std::vector<Rectification> rectified_pair(const Sensor& first, const Sensor& second) {
  const Pose second_from_first = second.sensor_from_mount * first.sensor_from_mount.inverse();
  const ImageSize size = first.lens.size();
  cv::Mat r1, r2, p1, p2, q;
  cv::stereoRectify(to_mat(camera_matrix(first.lens)), terms_mat(first.lens), to_mat(camera_matrix(second.lens)),
                    terms_mat(second.lens), {size.width_px, size.height_px},
                    to_mat(second_from_first.rotation.toRotationMatrix()), to_mat(second_from_first.translation), r1,
                    r2, p1, p2, q, cv::CALIB_ZERO_DISPARITY);
  return {from_mats(r1, p1), from_mats(r2, p2)};
}

std::string matrix_text(const std::string& name, const Eigen::MatrixXd& matrix) {
  std::vector<double> numbers;
  for (int row = 0; row < matrix.rows(); ++row) {
    for (int column = 0; column < matrix.cols(); ++column) numbers.push_back(matrix(row, column));
  }
  return fmt::format("{}:\n  rows: {}\n  cols: {}\n  data: {}\n", name, matrix.rows(), matrix.cols(),
                     yaml_numbers(numbers));
}

std::string camera_text(const Sensor& camera, const Rectification& rectification) {
  std::vector<double> terms = distortion_terms(camera.lens);
  terms.resize(std::max<std::size_t>(terms.size(), 5));
  const auto count = static_cast<Eigen::Index>(terms.size());
  return fmt::format("image_width: {}\nimage_height: {}\ncamera_name: {}\n", camera.lens.size().width_px,
                     camera.lens.size().height_px, camera.name) +
         matrix_text("camera_matrix", camera_matrix(camera.lens)) +
         fmt::format("distortion_model: {}\n", count == 5 ? "plumb_bob" : "rational_polynomial") +
         matrix_text("distortion_coefficients", Eigen::Map<const Eigen::RowVectorXd>(terms.data(), count)) +
         matrix_text("rectification_matrix", rectification.rotation) +
         matrix_text("projection_matrix", rectification.projection);
}

bool fits_ros(const Lens& lens) { return is_opencv_lens(lens) && lens.model() != "LENSMODEL_OPENCV12"; }

struct CameraInfo {
  Sensor camera;
  Rectification rectification;
};

std::vector<double> read_ros_terms(YamlMap& map) {
  const auto model = map.require("distortion_model", "plumb_bob or rational_polynomial");
  const auto matrix = map.require("distortion_coefficients", "{rows: 1, cols: 5, data: [k1, k2, t1, t2, k3]}");
  if (!model || !matrix) return {};
  const std::string name = model->text();
  if (name != "plumb_bob" && name != "rational_polynomial") {
    model->problem(
        fmt::format("must be plumb_bob or rational_polynomial, not {}: there is no such lens model in "
                    "Crumple",
                    name));
    return {};
  }
  const Eigen::MatrixXd terms = read_ros_matrix(*matrix, 1, name == "plumb_bob" ? 5 : 8);
  return {terms.data(), terms.data() + terms.size()};
}

int read_pixels(YamlMap& map, const std::string& key) {
  const auto pixels = map.require(key, "in pixels");
  return pixels ? pixels->integer(1, kLargestImage_px) : 1;
}

Expected<CameraInfo> parse(const std::string& text, const fs::path& file) {
  const auto root = parse_yaml(text, file.string());
  if (!root) return tl::unexpected(root.error());
  YamlProblems problems(file.string());
  YamlMap map = YamlValue(*root, "", &problems).map();
  const ImageSize size{read_pixels(map, "image_width"), read_pixels(map, "image_height")};
  const auto name = map.find("camera_name");
  const std::string camera_name = plain_name(name ? name->text() : file.stem().string());
  Eigen::MatrixXd matrix = Eigen::Matrix3d::Zero(), rotation = matrix, projection = Matrix34::Zero();
  if (const auto k = map.require("camera_matrix", "K, 3 x 3")) matrix = read_ros_matrix(*k, 3, 3);
  const std::vector<double> terms = read_ros_terms(map);
  if (const auto r = map.require("rectification_matrix", "R, 3 x 3")) rotation = read_ros_matrix(*r, 3, 3);
  if (const auto p = map.require("projection_matrix", "P, 3 x 4")) projection = read_ros_matrix(*p, 3, 4);
  if (auto error = problems.error()) return tl::unexpected(*error);
  auto lens = lens_from_opencv(size, matrix, terms);
  if (!lens) return fail(fmt::format("{}: {}", file.string(), lens.error().message));
  return CameraInfo{{camera_name, SensorKind::camera, std::move(*lens), {}}, {rotation, projection}};
}

// What P says of the camera's place in the rectified frame of the pair, mm.
Eigen::Vector3d offset_mm(const Matrix34& projection) {
  return kMmPerM *
         Eigen::Vector3d(projection(0, 3) / projection(0, 0), projection(1, 3) / projection(1, 1), projection(2, 3));
}

// Both cameras in the frame of the rectified pair.
Expected<Rig> rig_of_pair(std::vector<CameraInfo> pair) {
  const auto is_first = [](const CameraInfo& info) { return info.rectification.projection.col(3).isZero(0); };
  std::stable_partition(pair.begin(), pair.end(), is_first);
  if (!is_first(pair[0]) || is_first(pair[1])) {
    return fail(
        fmt::format("{} and {}: the projection matrix of one of a stereo pair, and of one only, has to have a "
                    "last column that is not zero: without it their poses are not known. Import each for itself",
                    pair[0].camera.name, pair[1].camera.name));
  }
  std::vector<Sensor> sensors;
  for (CameraInfo& info : pair) {
    const Matrix34& projection = info.rectification.projection;
    if (!(projection(0, 0) > 0 && projection(1, 1) > 0)) {
      return fail(fmt::format("{}: the projection matrix has no focal length", info.camera.name));
    }
    const auto rectified_from_camera = pose_from_matrix(info.rectification.rotation, Eigen::Vector3d::Zero());
    if (!rectified_from_camera) {
      return fail(fmt::format("{}: rectification_matrix: {}", info.camera.name, rectified_from_camera.error().message));
    }
    const Pose offset{Eigen::Quaterniond::Identity(), offset_mm(projection)};
    info.camera.sensor_from_mount = rectified_from_camera->inverse() * offset;
    sensors.push_back(std::move(info.camera));
  }
  return rig_from_sensors(std::move(sensors));
}

}  // namespace

Expected<std::vector<std::string>> write_ros_rig(const RigToExport& source, const fs::path& folder) {
  const std::vector<Sensor> cameras = cameras_of(source.rig);
  if (cameras.empty()) return fail("the rig has no camera, which is all that camera_info knows");
  for (const Sensor& camera : cameras) {
    if (!fits_ros(camera.lens)) {
      return lens_refused(camera, "ROS's camera_info", "LENSMODEL_PINHOLE and LENSMODEL_OPENCV4, 5 and 8");
    }
  }
  std::vector<Rectification> rectifications;
  if (cameras.size() == 2) {
    rectifications = rectified_pair(cameras[0], cameras[1]);
  } else {
    for (const Sensor& camera : cameras) rectifications.push_back(unrectified(camera.lens));
  }
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    const std::string text = camera_text(cameras[i], rectifications[i]);
    if (auto written = write_file(folder / (cameras[i].name + ".yaml"), text); !written) {
      return tl::unexpected(written.error());
    }
  }
  std::vector<std::string> lost = left_behind(source.rig, false);
  if (cameras.size() > 2) lost.emplace_back("the cameras' poses: camera_info holds those of two cameras at most");
  return lost;
}

Expected<Rig> read_ros_rig(const std::vector<fs::path>& inputs) {
  const auto files = files_named(inputs, ".yaml");
  if (!files) return tl::unexpected(files.error());
  std::vector<CameraInfo> infos;
  for (const fs::path& file : *files) {
    const auto text = read_file(file);
    if (!text) return tl::unexpected(text.error());
    auto info = parse(*text, file);
    if (!info) return tl::unexpected(info.error());
    infos.push_back(std::move(*info));
  }
  if (infos.size() > 2) {
    return fail(
        fmt::format("{} cameras: camera_info holds the poses of two at most. Import one or two files", infos.size()));
  }
  if (infos.size() == 2) return rig_of_pair(std::move(infos));
  return rig_from_sensors({infos.front().camera});
}

}  // namespace crumple
