#include "datasets/formats/kalibr_rig.h"

#include <fmt/format.h>

#include "datasets/formats/foreign_rig.h"
#include "datasets/formats/yaml_matrix.h"
#include "datasets/output_folder.h"
#include "datasets/yaml_reader.h"
#include "datasets/yaml_values.h"

namespace crumple {
namespace {

namespace fs = std::filesystem;

constexpr const char* kFileName = "camchain.yaml";
const std::string kTopicEnd = "/image_raw";

std::string matrix_text(const Pose& pose_mm) {
  const Eigen::Matrix3d rotation = pose_mm.rotation.toRotationMatrix();
  std::string text = "  T_cn_cnm1:\n";
  for (int row = 0; row < 3; ++row) {
    text += "  - " +
            yaml_numbers({rotation(row, 0), rotation(row, 1), rotation(row, 2), pose_mm.translation[row] / kMmPerM}) +
            "\n";
  }
  return text + "  - [0.0, 0.0, 0.0, 1.0]\n";
}

std::string camera_text(const Sensor& camera, std::size_t index) {
  const std::vector<double> terms = distortion_terms(camera.lens);
  const std::vector<double> core(camera.lens.parameters().begin(), camera.lens.parameters().begin() + 4);
  return fmt::format(
      "cam{}:\n  camera_model: pinhole\n  intrinsics: {}\n  distortion_model: {}\n  distortion_coeffs: {}\n"
      "  resolution: [{}, {}]\n  rostopic: /{}{}\n",
      index, yaml_numbers(core), terms.empty() ? "none" : "radtan", yaml_numbers(terms), camera.lens.size().width_px,
      camera.lens.size().height_px, camera.name, kTopicEnd);
}

bool fits_kalibr(const Lens& lens) {
  return lens.model() == "LENSMODEL_PINHOLE" || lens.model() == "LENSMODEL_OPENCV4";
}

// Lens terms by Kalibr's name of their model.
std::vector<double> read_kalibr_terms(YamlMap& map) {
  const auto model = map.require("distortion_model", "radtan or none");
  if (!model) return {};
  const std::string name = model->text();
  if (name != "radtan" && name != "none") {
    model->problem(fmt::format("must be radtan or none, not {}: there is no such lens model in Crumple", name));
    return {};
  }
  const auto terms = map.require("distortion_coeffs", "[k1, k2, r1, r2], or [] where there is no distortion");
  return terms ? read_row(*terms, name == "none" ? 0 : 4) : std::vector<double>();
}

std::optional<Lens> read_lens(YamlMap& map) {
  if (const auto model = map.require("camera_model", "pinhole")) model->one_of({"pinhole"});
  std::vector<double> core;
  if (const auto intrinsics = map.require("intrinsics", "[fu, fv, pu, pv]")) core = read_row(*intrinsics, 4);
  const std::vector<double> terms = read_kalibr_terms(map);
  const auto size = map.require("resolution", "[width, height]");
  const std::vector<double> pixels = size ? read_row(*size, 2) : std::vector<double>();
  if (core.size() != 4 || pixels.size() != 2) return {};
  core.insert(core.end(), terms.begin(), terms.end());
  auto lens = Lens::create(terms.empty() ? "LENSMODEL_PINHOLE" : "LENSMODEL_OPENCV4", whole_size(*size, pixels), core);
  if (lens) return std::move(*lens);
  map.problem(lens.error().message);
  return {};
}

std::string read_name(YamlMap& map, const std::string& key) {
  const auto topic = map.find("rostopic");
  if (!topic) return key;
  const std::string text = topic->text();
  const bool ours = text.starts_with('/') && text.ends_with(kTopicEnd) && text.size() > 1 + kTopicEnd.size();
  const std::string name = ours ? text.substr(1, text.size() - 1 - kTopicEnd.size()) : "";
  return is_plain_name(name) ? name : key;
}

Pose read_step(const YamlValue& value) {
  const Eigen::MatrixXd matrix = read_rows(value, 4, 4);
  if (matrix.isZero(0)) return {};  // beside a problem
  if (matrix.row(3) != Eigen::RowVector4d(0, 0, 0, 1)) value.problem("must end with the row [0, 0, 0, 1]");
  const auto pose = pose_from_matrix(matrix.topLeftCorner<3, 3>(), kMmPerM * matrix.topRightCorner<3, 1>());
  if (!pose) value.problem(pose.error().message);
  return pose.value_or(Pose());
}

Expected<Rig> parse(const std::string& text, const std::string& file) {
  const auto root = parse_yaml(text, file);
  if (!root) return tl::unexpected(root.error());
  YamlProblems problems(file);
  const YamlValue document(*root, "", &problems);
  YamlMap map = document.map();
  std::vector<Sensor> cameras;
  Pose camera_from_first;
  while (const auto camera = map.find(fmt::format("cam{}", cameras.size()))) {
    YamlMap keys = camera->map();
    auto lens = read_lens(keys);
    const auto step = cameras.empty() ? std::nullopt : keys.require("T_cn_cnm1", "the pose from the camera before");
    if (step) camera_from_first = read_step(*step) * camera_from_first;
    const std::string name = read_name(keys, fmt::format("cam{}", cameras.size()));
    if (!lens) break;  // beside a problem
    cameras.push_back({name, SensorKind::camera, std::move(*lens), camera_from_first});
  }
  if (auto error = problems.error()) return tl::unexpected(*error);
  if (cameras.empty()) return fail(file + ": holds no cam0, so it is not a camchain of Kalibr's");
  return rig_from_sensors(std::move(cameras));
}

}  // namespace

Expected<std::vector<std::string>> write_kalibr_rig(const RigToExport& source, const fs::path& folder) {
  const std::vector<Sensor> cameras = cameras_of(source.rig);
  std::string text;
  Pose previous_from_probe;
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    if (!fits_kalibr(cameras[i].lens)) {
      return lens_refused(cameras[i], "a camchain of Kalibr's", "LENSMODEL_PINHOLE and LENSMODEL_OPENCV4");
    }
    text += camera_text(cameras[i], i);
    if (i > 0) text += matrix_text(cameras[i].sensor_from_mount * previous_from_probe.inverse());
    previous_from_probe = cameras[i].sensor_from_mount;
  }
  if (cameras.empty()) return fail("the rig has no camera, which is all that Kalibr knows");
  if (auto written = write_file(folder / kFileName, text); !written) return tl::unexpected(written.error());
  return left_behind(source.rig, false);
}

Expected<Rig> read_kalibr_rig(const std::vector<fs::path>& inputs) {
  const auto files = files_named(inputs, ".yaml");
  if (!files) return tl::unexpected(files.error());
  if (files->size() != 1) return fail(fmt::format("a camchain is one file, {} were given", files->size()));
  const auto text = read_file(files->front());
  if (!text) return tl::unexpected(text.error());
  return parse(*text, files->front().string());
}

}  // namespace crumple
