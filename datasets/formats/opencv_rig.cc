#include "datasets/formats/opencv_rig.h"

#include <algorithm>
#include <exception>

#include <fmt/format.h>
#include <opencv2/core.hpp>
#include <opencv2/core/eigen.hpp>

#include "datasets/formats/foreign_rig.h"
#include "datasets/limits.h"
#include "datasets/output_folder.h"

namespace crumple {
namespace {

namespace fs = std::filesystem;

constexpr int kOpencvTerms = 14;  // the most of its distortion

std::string sensor_text(const Sensor& sensor) {
  cv::FileStorage storage(".yml", cv::FileStorage::WRITE | cv::FileStorage::MEMORY);
  const std::vector<double> terms = distortion_terms(sensor.lens);
  storage << "image_width" << sensor.lens.size().width_px << "image_height" << sensor.lens.size().height_px;
  storage << "camera_matrix" << to_mat(camera_matrix(sensor.lens));
  storage << "distortion_coefficients"
          << to_mat(Eigen::Map<const Eigen::VectorXd>(terms.data(), static_cast<Eigen::Index>(terms.size())));
  storage << "R" << to_mat(sensor.sensor_from_mount.rotation.toRotationMatrix());
  storage << "T" << to_mat(sensor.sensor_from_mount.translation);
  storage << "sensor_kind" << (sensor.kind == SensorKind::camera ? "camera" : "projector");
  return storage.releaseAndGetString();
}

// What OpenCV would reserve memory for, before it knows how many numbers follow.
bool states_size(const cv::FileNode& node, int rows, int columns) {
  if (!node.isMap() || !node["sizes"].empty()) return false;
  const int stated_rows = static_cast<int>(node["rows"]), stated_columns = static_cast<int>(node["cols"]);
  if (rows != 0) return stated_rows == rows && stated_columns == columns;
  return stated_rows >= 0 && stated_rows <= kOpencvTerms && stated_columns >= 0 && stated_columns <= kOpencvTerms;
}

// One channel of float or double, of the size asked for; up to as many terms as OpenCV knows where `rows` is 0.
Expected<Eigen::MatrixXd> read_matrix(const cv::FileStorage& storage, const std::string& name, int rows, int columns) {
  const cv::FileNode node = storage[name];
  if (node.empty()) return fail(fmt::format("'{}' is missing", name));
  const auto refusal = [&] {
    return fail(rows == 0
                    ? fmt::format("'{}' has to be a matrix of float or double, of at most {} terms", name, kOpencvTerms)
                    : fmt::format("'{}' has to be a {} x {} matrix of float or double", name, rows, columns));
  };
  if (!states_size(node, rows, columns)) return refusal();
  cv::Mat read;
  node >> read;
  const bool numbers = read.empty() || (read.dims == 2 && (read.type() == CV_64F || read.type() == CV_32F));
  if (!numbers || (rows != 0 && (read.rows != rows || read.cols != columns))) return refusal();
  Eigen::MatrixXd matrix;
  if (!read.empty()) cv::cv2eigen(read, matrix);
  if (!matrix.allFinite()) return fail(fmt::format("'{}' holds a number that is not finite", name));
  return matrix;
}

Expected<int> read_pixels(const cv::FileStorage& storage, const std::string& name) {
  const cv::FileNode node = storage[name];
  const int pixels = node.isInt() ? static_cast<int>(node) : 0;
  if (pixels > 0 && pixels <= kLargestImage_px) return pixels;
  return fail(fmt::format("'{}' has to be a whole number of pixels", name));
}

Expected<Lens> read_lens(const cv::FileStorage& storage) {
  const auto width = read_pixels(storage, "image_width");
  if (!width) return tl::unexpected(width.error());
  const auto height = read_pixels(storage, "image_height");
  if (!height) return tl::unexpected(height.error());
  const auto matrix = read_matrix(storage, "camera_matrix", 3, 3);
  if (!matrix) return tl::unexpected(matrix.error());
  const auto terms = read_matrix(storage, "distortion_coefficients", 0, 0);
  if (!terms) return tl::unexpected(terms.error());
  if (terms->size() > 0 && terms->rows() != 1 && terms->cols() != 1) {
    return fail("'distortion_coefficients' has to be one row or one column");
  }
  return lens_from_opencv({*width, *height}, *matrix, {terms->data(), terms->data() + terms->size()});
}

bool has_pose(const cv::FileStorage& storage) { return !storage["R"].empty() || !storage["T"].empty(); }

Expected<Pose> read_pose(const cv::FileStorage& storage) {
  const auto rotation = read_matrix(storage, "R", 3, 3);
  if (!rotation) return tl::unexpected(rotation.error());
  const auto translation = read_matrix(storage, "T", 3, 1);
  if (!translation) return tl::unexpected(translation.error());
  return pose_from_matrix(*rotation, translation->col(0));
}

Expected<SensorKind> read_kind(const cv::FileStorage& storage) {
  const cv::FileNode node = storage["sensor_kind"];
  if (node.empty()) return SensorKind::camera;
  const std::string kind = node.isString() ? static_cast<std::string>(node) : "";
  if (kind == "camera") return SensorKind::camera;
  if (kind == "projector") return SensorKind::projector;
  return fail("'sensor_kind' has to be camera or projector");
}

// A sensor without R and T is at the reference.
Expected<Sensor> sensor_from(const cv::FileStorage& storage, const std::string& name, bool may_lack_pose) {
  auto lens = read_lens(storage);
  if (!lens) return tl::unexpected(lens.error());
  const auto kind = read_kind(storage);
  if (!kind) return tl::unexpected(kind.error());
  if (!has_pose(storage) && may_lack_pose) return Sensor{name, *kind, std::move(*lens), Pose()};
  const auto pose = read_pose(storage);
  if (!pose) return tl::unexpected(pose.error());
  return Sensor{name, *kind, std::move(*lens), *pose};
}

Expected<Sensor> read_sensor(const fs::path& file, bool may_lack_pose) {
  const auto text = read_file(file);
  if (!text) return tl::unexpected(text.error());
  const auto named = [&](const std::string& message) { return fail(fmt::format("{}: {}", file.string(), message)); };
  try {
    const cv::FileStorage storage(*text, cv::FileStorage::READ | cv::FileStorage::MEMORY);
    if (!storage.isOpened()) return named("not a file of cv::FileStorage");
    auto sensor = sensor_from(storage, plain_name(file.stem().string()), may_lack_pose);
    if (!sensor) return named(sensor.error().message);
    return sensor;
  } catch (const cv::Exception& exception) {
    return named("not a file of cv::FileStorage: " + exception.err);
  } catch (const std::exception& exception) {  // its parser lets those of the standard library through
    return named(std::string("not a file of cv::FileStorage: ") + exception.what());
  }
}

}  // namespace

Expected<std::vector<std::string>> write_opencv_rig(const RigToExport& source, const fs::path& folder) {
  const Rig rig = scaled(source.rig, 1 / source.mm_per_unit);
  for (const Sensor& sensor : rig.sensors) {
    if (!is_opencv_lens(sensor.lens)) {
      return lens_refused(sensor, "OpenCV", "LENSMODEL_PINHOLE and LENSMODEL_OPENCV4, 5, 8 and 12");
    }
  }
  for (const Sensor& sensor : rig.sensors) {
    if (auto written = write_file(folder / (sensor.name + ".yml"), sensor_text(sensor)); !written) {
      return tl::unexpected(written.error());
    }
  }
  return left_behind(rig, true);
}

Expected<Rig> read_opencv_rig(const std::vector<fs::path>& inputs) {
  const auto files = files_named(inputs, ".yml");
  if (!files) return tl::unexpected(files.error());
  std::vector<Sensor> sensors;
  for (const fs::path& file : *files) {
    auto sensor = read_sensor(file, file == files->front());
    if (!sensor) return tl::unexpected(sensor.error());
    sensors.push_back(std::move(*sensor));
  }
  if (*files != inputs) std::stable_partition(sensors.begin(), sensors.end(), is_at_reference);
  return rig_from_sensors(std::move(sensors));
}

}  // namespace crumple
