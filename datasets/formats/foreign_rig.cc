#include "datasets/formats/foreign_rig.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <system_error>

#include <Eigen/LU>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <opencv2/core.hpp>
#include <opencv2/core/eigen.hpp>

#include "datasets/limits.h"

namespace crumple {
namespace {

namespace fs = std::filesystem;

constexpr int kLargestSide_px = 65500;    // of images, as in rig.yaml
constexpr double kMatrixRounding = 1e-4;  // of rotation matrices that people print to four digits and copy

Expected<void> check_bounds(const Sensor& sensor) {
  const auto beyond = [](double value) { return !(std::abs(value) <= kLargestValue); };
  const std::vector<double>& parameters = sensor.lens.parameters();
  const Eigen::Vector3d& translation = sensor.sensor_from_mount.translation;
  if (std::any_of(parameters.begin(), parameters.end(), beyond) ||
      std::any_of(translation.begin(), translation.end(), beyond)) {
    return fail(fmt::format("{} has a number beyond {:g}", sensor.name, kLargestValue));
  }
  const ImageSize size = sensor.lens.size();
  if (std::max(size.width_px, size.height_px) > kLargestSide_px) {
    return fail(fmt::format("{} has an image of {} x {} px, beyond {} px a side", sensor.name, size.width_px,
                            size.height_px, kLargestSide_px));
  }
  return {};
}

}  // namespace

Expected<Lens> lens_from_opencv(ImageSize size, const Eigen::Matrix3d& matrix, std::vector<double> terms) {
  const Eigen::Matrix3d bare = (Eigen::Matrix3d() << 0, 0, 0, 0, 0, 0, 0, 0, 1).finished();
  Eigen::Matrix3d rest = matrix;
  rest(0, 0) = rest(1, 1) = rest(0, 2) = rest(1, 2) = 0;
  if (rest != bare) return fail("the camera matrix has to be [fx 0 cx; 0 fy cy; 0 0 1]: there are no lenses with skew");
  if (terms.size() == 14) {
    if (terms[12] != 0 || terms[13] != 0) return fail("a tilted sensor (tau_x, tau_y) is not among the lens models");
    terms.resize(12);
  }
  const bool known = terms.empty() || terms.size() == 4 || terms.size() == 5 || terms.size() == 8 || terms.size() == 12;
  if (!known) return fail(fmt::format("{} distortion terms: it has to be 0, 4, 5, 8, 12 or 14", terms.size()));
  std::vector<double> parameters{matrix(0, 0), matrix(1, 1), matrix(0, 2), matrix(1, 2)};
  parameters.insert(parameters.end(), terms.begin(), terms.end());
  const std::string model = terms.empty() ? "LENSMODEL_PINHOLE" : fmt::format("LENSMODEL_OPENCV{}", terms.size());
  return Lens::create(model, size, std::move(parameters));
}

bool is_opencv_lens(const Lens& lens) {
  return lens.model() == "LENSMODEL_PINHOLE" || lens.model().starts_with("LENSMODEL_OPENCV");
}

Eigen::Matrix3d camera_matrix(const Lens& lens) {
  const std::vector<double>& p = lens.parameters();
  return (Eigen::Matrix3d() << p[0], 0, p[2], 0, p[1], p[3], 0, 0, 1).finished();
}

std::vector<double> distortion_terms(const Lens& lens) {
  return {lens.parameters().begin() + 4, lens.parameters().end()};
}

cv::Mat to_mat(const Eigen::MatrixXd& matrix) {
  cv::Mat result;
  cv::eigen2cv(matrix, result);
  return result;
}

Expected<Pose> pose_from_matrix(const Eigen::Matrix3d& rotation, const Eigen::Vector3d& translation) {
  const double off = (rotation.transpose() * rotation - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff();
  if (!(off < kMatrixRounding) || rotation.determinant() < 0)
    return fail("the rotation matrix is not one of a rotation");
  if (!translation.allFinite()) return fail("the translation holds a number that is not finite");
  return Pose{Eigen::Quaterniond(nearest_rotation(rotation)).normalized(), translation};
}

Expected<Rig> rig_from_sensors(std::vector<Sensor> sensors) {
  Rig rig;
  const Pose common_from_first = sensors.front().sensor_from_mount.inverse();
  for (Sensor& sensor : sensors) {
    sensor.sensor_from_mount = sensor.sensor_from_mount * common_from_first;
    sensor.sensor_from_mount.rotation.normalize();
  }
  sensors.front().sensor_from_mount = Pose();
  for (const Sensor& sensor : sensors) {
    if (auto held = check_bounds(sensor); !held) return tl::unexpected(held.error());
  }
  rig.sensors = std::move(sensors);
  return rig;
}

bool is_at_reference(const Sensor& sensor) {
  const Pose& pose = sensor.sensor_from_mount;
  return sensor.kind == SensorKind::camera && pose.translation.isZero(0) && pose.rotation.vec().isZero(0);
}

std::vector<Sensor> cameras_of(const Rig& rig) {
  std::vector<Sensor> cameras;
  for (const Sensor& sensor : rig.sensors) {
    if (sensor.kind == SensorKind::camera) cameras.push_back(sensor);
  }
  return cameras;
}

tl::unexpected<Error> lens_refused(const Sensor& sensor, const std::string& format, const std::string& holds) {
  return fail(
      fmt::format("{} has the lens model {}, which {} cannot hold: it holds {}. Calibrate with such a model "
                  "(crumple calibrate --lens=MODEL), or export to another format",
                  sensor.name, sensor.lens.model(), format, holds));
}

std::vector<std::string> left_behind(const Rig& rig, bool projectors) {
  std::vector<std::string> sentences;
  for (const Sensor& sensor : rig.sensors) {
    if (!projectors && sensor.kind == SensorKind::projector) {
      sentences.push_back(fmt::format("projector {}: the format knows cameras only", sensor.name));
    }
  }
  if (!rig.leds.empty()) sentences.emplace_back("the LEDs");
  if (!rig.covariance.names.empty()) sentences.emplace_back("the covariance of the rig");
  if (!rig.sigma_px.empty()) sentences.emplace_back("the noise of the observations (sigma_px)");
  return sentences;
}

Expected<std::vector<fs::path>> files_named(const std::vector<fs::path>& inputs, const std::string& extension) {
  if (inputs.size() != 1 || !fs::is_directory(inputs.front())) return inputs;
  std::vector<fs::path> files;
  std::error_code failure;
  for (const fs::directory_entry& entry : fs::directory_iterator(inputs.front(), failure)) {
    if (entry.path().extension() == extension) files.push_back(entry.path());
  }
  if (failure) return fail(fmt::format("{} cannot be read: {}", inputs.front().string(), failure.message()));
  if (files.empty()) return fail(fmt::format("{} holds no {} file", inputs.front().string(), extension));
  std::sort(files.begin(), files.end());
  return files;
}

std::string plain_name(const std::string& text) {
  std::string name = text.empty() ? "_" : text.substr(0, 100);
  for (char& c : name) {
    if (std::isalnum(static_cast<unsigned char>(c)) == 0 && c != '-') c = '_';
  }
  return name;
}

std::string yaml_number(double value) {
  std::string text = fmt::format("{}", value);
  if (text.find('.') != std::string::npos) return text;
  return text.insert(std::min(text.find('e'), text.size()), ".0");
}

std::string yaml_numbers(const std::vector<double>& values) {
  std::vector<std::string> texts;
  for (const double value : values) texts.push_back(yaml_number(value));
  return fmt::format("[{}]", fmt::join(texts, ", "));
}

}  // namespace crumple
