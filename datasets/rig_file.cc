#include "datasets/rig_file.h"

#include <algorithm>
#include <cmath>
#include <set>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "datasets/cameramodel_file.h"
#include "datasets/limits.h"
#include "datasets/npy_file.h"
#include "datasets/output_folder.h"
#include "datasets/pose_yaml.h"
#include "datasets/tracker_yaml.h"
#include "datasets/yaml_reader.h"
#include "datasets/yaml_text.h"
#include "datasets/yaml_values.h"
#include "solvers/rig_covariance.h"

namespace crumple {
namespace fs = std::filesystem;
namespace {

// Version 2 adds LEDs and sensors fixed to the world, version 3 what the scale's uncertainty lacks, version 4 the
// calibration's verdict. A rig is written as the first version that holds what it has.
const std::vector<std::string> kRigSchemas = {"crumple-rig/4", "crumple-rig/3", "crumple-rig/2", "crumple-rig/1"};
constexpr int kNewestRig = 4;
constexpr const char* description_name = "rig.yaml";
constexpr const char* covariance_name = "covariance.npy";

// Rounding between a quaternion and the rotation vector in the .cameramodel.
constexpr double rounding = 1e-9;

// Of a scale that an earlier version wrote.
constexpr const char* kLacksUnrecorded = "whether its certificates were complete was not recorded with the rig";

const std::string& rig_schema(int version) { return kRigSchemas[static_cast<std::size_t>(kNewestRig - version)]; }

bool has_scale(const std::vector<std::string>& rows) { return std::any_of(rows.begin(), rows.end(), is_scale); }

int first_version_of(const Rig& rig) {
  if (!rig.doubts.empty()) return 4;
  if (has_scale(rig.covariance.names) || !rig.scale_lacks.empty()) return 3;
  const bool in_world = std::any_of(rig.sensors.begin(), rig.sensors.end(),
                                    [](const Sensor& sensor) { return sensor.mount == Mount::world; });
  return in_world || !rig.leds.empty() ? 2 : 1;
}

const char* pose_key(Mount mount) { return mount == Mount::world ? "sensor_from_world" : "sensor_from_probe"; }

std::string description(const Rig& rig) {
  std::string text =
      fmt::format("schema: {}\nunits: {{length: mm, angle: rad}}\nsensors:\n", rig_schema(first_version_of(rig)));
  for (const Sensor& sensor : rig.sensors) {
    text += fmt::format(
        "  - name: {}\n    kind: {}\n    size_px: [{}, {}]\n    lens_model: {}\n    file: {}\n"
        "    {}:\n{}",
        yaml_quoted(sensor.name), sensor.kind == SensorKind::camera ? "camera" : "projector",
        sensor.lens.size().width_px, sensor.lens.size().height_px, sensor.lens.model(),
        yaml_quoted(sensor.name + ".cameramodel"), pose_key(sensor.mount), pose_yaml(sensor.sensor_from_mount, 6));
    if (sensor.lens_of) text += fmt::format("    lens_of: {}\n", yaml_quoted(rig.sensors[*sensor.lens_of].name));
  }
  if (!rig.leds.empty()) text += "leds:\n";
  for (const Led& led : rig.leds) {
    text += fmt::format("  - {{name: {}, mount: {}, position_mm: [{}, {}, {}]}}\n", yaml_quoted(led.name),
                        led.mount == Mount::world ? "world" : "probe", led.position_mm.x(), led.position_mm.y(),
                        led.position_mm.z());
  }
  if (!rig.sigma_px.empty()) text += "sigma_px:\n";
  for (const auto& [group, sigma_px] : rig.sigma_px) text += fmt::format("  {}: {}\n", yaml_quoted(group), sigma_px);
  if (!rig.scale_lacks.empty()) text += "scale_lacks:\n";
  for (const std::string& lack : rig.scale_lacks) text += fmt::format("  - {}\n", yaml_quoted(lack));
  if (!rig.doubts.empty()) {
    text += fmt::format("verdict:\n  level: {}\n  reasons:\n", rig.rejected ? "rejected" : "suspect");
    for (const std::string& doubt : rig.doubts) text += fmt::format("    - {}\n", yaml_quoted(doubt));
  }
  if (rig.covariance.names.empty()) return text;
  text += fmt::format("covariance:\n  file: {}\n  rows:\n", covariance_name);
  for (const std::string& name : rig.covariance.names) text += fmt::format("    - {}\n", yaml_quoted(name));
  return text;
}

Expected<void> check_sensor(const Sensor& sensor, std::set<std::string>& names) {
  if (!is_plain_name(sensor.name))
    return fail(
        fmt::format("The sensor name \"{}\" cannot be a file name: use letters, digits, - and _.", sensor.name));
  if (!names.insert(sensor.name).second) return fail(fmt::format("Two sensors are named {}.", sensor.name));
  bool finite =
      sensor.sensor_from_mount.rotation.coeffs().allFinite() && sensor.sensor_from_mount.translation.allFinite();
  for (const double parameter : sensor.lens.parameters()) finite = finite && std::isfinite(parameter);
  if (!finite) return fail(fmt::format("Sensor {} has a number that is not finite; no rig was written.", sensor.name));
  return {};
}

Expected<void> check_led(const Led& led, std::set<std::string>& names) {
  if (!is_plain_name(led.name))
    return fail(fmt::format("The LED name \"{}\" is unusable: use letters, digits, - and _.", led.name));
  if (!names.insert(led.name).second)
    return fail(fmt::format("Two LEDs, or an LED and a sensor, are named {}.", led.name));
  if (led.position_mm.allFinite()) return {};
  return fail(fmt::format("LED {} has a number that is not finite; no rig was written.", led.name));
}

Expected<void> check_covariance(const RigCovariance& covariance) {
  const auto rows = static_cast<Eigen::Index>(covariance.names.size());
  const Eigen::MatrixXd& matrix = covariance.matrix;
  if (matrix.rows() != rows || matrix.cols() != rows)
    return fail(fmt::format("it is {} x {}, but {} rows are named", matrix.rows(), matrix.cols(), rows));
  const double asymmetry = rows == 0 ? 0 : (matrix - matrix.transpose()).cwiseAbs().maxCoeff();
  if (!matrix.allFinite()) return fail("it holds a number that is not finite");
  for (Eigen::Index i = 0; i < rows; ++i)
    if (!(matrix(i, i) > 0))
      return fail(fmt::format("the variance of {} is not above zero", covariance.names[static_cast<std::size_t>(i)]));
  if (rows > 0 && asymmetry > rounding * matrix.diagonal().maxCoeff()) return fail("it is not symmetric");
  return {};
}

Expected<void> check_rig(const Rig& rig) {
  if (rig.sensors.empty()) return fail("A rig without sensors cannot be written.");
  std::set<std::string> names;
  for (const Sensor& sensor : rig.sensors)
    if (auto sound = check_sensor(sensor, names); !sound) return sound;
  for (const Led& led : rig.leds)
    if (auto sound = check_led(led, names); !sound) return sound;
  for (const auto& [group, sigma_px] : rig.sigma_px)
    if (!(sigma_px > 0 && sigma_px < kLargestValue)) return fail(fmt::format("sigma of {} is {} px.", group, sigma_px));
  for (const std::string& lack : rig.scale_lacks)
    if (lack.empty()) return fail("The rig's scale lacks something without words for it; no rig was written.");
  for (const std::string& doubt : rig.doubts)
    if (doubt.empty()) return fail("The rig's verdict has a reason without words; no rig was written.");
  if (auto sound = check_covariance(rig.covariance); !sound)
    return fail(fmt::format("The rig's covariance is unusable: {}.", sound.error().message));
  return {};
}

// What rig.yaml says of a sensor; its lens is in another file.
struct SensorEntry {
  std::string name;
  SensorKind kind = SensorKind::camera;
  ImageSize size;
  std::string lens_model;
  std::string file;
  Pose sensor_from_mount;
  Mount mount = Mount::probe;
  std::string lens_of;
};

void refuse_before(int since, int version, const YamlValue& value) {
  if (version < since) value.problem("is new in " + rig_schema(since));
}

SensorEntry read_sensor(const YamlValue& value, int version) {
  SensorEntry entry;
  YamlMap map = value.map();
  if (const auto name = map.require("name", "of the sensor")) {
    entry.name = name->text();
    if (!is_plain_name(entry.name)) name->problem("must consist of letters, digits, - and _");
  }
  if (const auto kind = map.require("kind", "camera or projector"))
    entry.kind = kind->one_of({"camera", "projector"}) == "camera" ? SensorKind::camera : SensorKind::projector;
  entry.size = read_size_px(map);
  if (const auto model = map.require("lens_model", "such as LENSMODEL_OPENCV5")) entry.lens_model = model->text();
  if (const auto file = map.require("file", "the .cameramodel with the lens")) {
    entry.file = file->text();
    if (entry.file.find('/') != std::string::npos) file->problem("must be a file in the rig's own folder");
  }
  const auto in_world = map.find(pose_key(Mount::world));
  const auto on_probe = map.find(pose_key(Mount::probe));
  if (in_world) refuse_before(2, version, *in_world);
  if (in_world.has_value() == on_probe.has_value())
    map.problem(
        "must have `sensor_from_probe`, the sensor's pose, or `sensor_from_world` where it is fixed to the world");
  if (in_world) entry.mount = Mount::world;
  if (const auto& pose = in_world ? in_world : on_probe) entry.sensor_from_mount = read_pose(*pose);
  if (const auto lens_of = map.find("lens_of")) {
    refuse_before(2, version, *lens_of);
    entry.lens_of = lens_of->text();
  }
  map.finish();
  return entry;
}

Led read_led(const YamlValue& value) {
  Led led;
  YamlMap map = value.map();
  if (const auto name = map.require("name", "of the LED")) {
    led.name = name->text();
    if (!is_plain_name(led.name)) name->problem("must consist of letters, digits, - and _");
  }
  led.mount = read_mount(map.require("mount", "probe or world"));
  if (const auto position = map.require("position_mm", "[x, y, z] in its mount's frame"))
    led.position_mm = read_vector<3>(*position, -kLargestValue, kLargestValue);
  map.finish();
  return led;
}

double read_sigma(const YamlValue& value) {
  const double sigma_px = value.positive_number();
  if (sigma_px >= kLargestValue) value.problem(fmt::format("must be below {:g}", kLargestValue));
  return sigma_px;
}

struct RigEntries {
  std::vector<SensorEntry> sensors;
  std::vector<Led> leds;
  std::map<std::string, double> sigma_px;
  std::vector<std::string> scale_lacks;
  std::vector<std::string> doubts;
  bool rejected = false;
  std::string covariance_file;
  std::vector<std::string> covariance_rows;
};

void read_covariance_entry(const YamlValue& value, RigEntries& entries) {
  YamlMap map = value.map();
  if (const auto file = map.require("file", covariance_name)) {
    entries.covariance_file = file->one_of({covariance_name});
  }
  if (const auto rows = map.require("rows", "what each row is, such as cam0.fx"))
    for (const YamlValue& row : rows->list()) entries.covariance_rows.push_back(row.text());
  map.finish();
}

void read_verdict(const YamlValue& value, RigEntries& entries) {
  YamlMap map = value.map();
  if (const auto level = map.require("level", "suspect or rejected")) {
    entries.rejected = level->one_of({"suspect", "rejected"}) == "rejected";
  }
  if (const auto reasons = map.require("reasons", "a list of sentences")) {
    for (const YamlValue& reason : reasons->list()) entries.doubts.push_back(reason.text());
    if (entries.doubts.empty()) reasons->problem("must have at least one");
  }
  map.finish();
}

Expected<RigEntries> read_description(const fs::path& file) {
  const auto text = read_file(file);
  if (!text) return tl::unexpected(text.error());
  const auto root = parse_yaml(*text, file.string());
  if (!root) return tl::unexpected(root.error());
  YamlProblems problems(file.string());
  RigEntries entries;
  YamlMap map = YamlValue(*root, "", &problems).map();
  int version = kNewestRig;
  if (const auto schema = map.require("schema", kRigSchemas.front())) {
    const auto known = std::find(kRigSchemas.begin(), kRigSchemas.end(), schema->one_of(kRigSchemas));
    version = static_cast<int>(kRigSchemas.end() - known);
  }
  if (const auto units = map.require("units", "{length: mm, angle: rad}")) {
    YamlMap unit_map = units->map();
    if (const auto length = unit_map.require("length", "mm")) length->one_of({"mm"});
    if (const auto angle = unit_map.require("angle", "rad")) angle->one_of({"rad"});
    unit_map.finish();
  }
  if (const auto sensors = map.require("sensors", "the list of sensors")) {
    for (const YamlValue& sensor : sensors->list()) entries.sensors.push_back(read_sensor(sensor, version));
    if (entries.sensors.empty()) sensors->problem("must list at least one sensor");
  }
  if (const auto leds = map.find("leds")) {
    refuse_before(2, version, *leds);
    for (const YamlValue& led : leds->list()) entries.leds.push_back(read_led(led));
  }
  if (const auto sigma = map.find("sigma_px"))
    for (const auto& [group, value] : sigma->map().entries()) entries.sigma_px[group] = read_sigma(value);
  if (const auto lacks = map.find("scale_lacks")) {
    refuse_before(3, version, *lacks);
    for (const YamlValue& lack : lacks->list()) entries.scale_lacks.push_back(lack.text());
    if (entries.scale_lacks.empty()) lacks->problem("must say something, or be left out where nothing lacks");
  }
  if (const auto verdict = map.find("verdict")) {
    refuse_before(4, version, *verdict);
    read_verdict(*verdict, entries);
  }
  if (const auto covariance = map.find("covariance")) read_covariance_entry(*covariance, entries);
  if (version < 3 && has_scale(entries.covariance_rows)) entries.scale_lacks = {kLacksUnrecorded};
  map.finish();
  if (auto error = problems.error()) return tl::unexpected(*error);
  return entries;
}

Expected<Sensor> read_lens(const fs::path& folder, const SensorEntry& entry) {
  const auto model = read_cameramodel(folder / entry.file);
  if (!model) return tl::unexpected(model.error());
  const auto differs = [&](const char* what) {
    return fail(fmt::format("{} and {} state different {}s for {}. One of them was edited; restore the pair.",
                            (folder / entry.file).string(), description_name, what, entry.name));
  };
  if (model->lens.model() != entry.lens_model) return differs("lens model");
  if (model->lens.size() != entry.size) return differs("size");
  const Vector6d step = local_step(entry.sensor_from_mount, model->camera_from_reference);
  const double scale = 1 + entry.sensor_from_mount.translation.norm();
  if (step.head<3>().norm() > rounding || step.tail<3>().norm() > rounding * scale) return differs("pose");
  return Sensor{entry.name, entry.kind, model->lens, entry.sensor_from_mount, entry.mount};
}

}  // namespace

Expected<void> write_rig(const fs::path& folder, const Rig& rig) {
  if (auto sound = check_rig(rig); !sound) return sound;
  for (const Sensor& sensor : rig.sensors) {
    const fs::path file = folder / (sensor.name + ".cameramodel");
    if (auto written = write_cameramodel(file, {sensor.lens, sensor.sensor_from_mount}); !written) return written;
  }
  if (!rig.covariance.names.empty())
    if (auto written = write_npy(folder / covariance_name, rig.covariance.matrix); !written) return written;
  return write_file(folder / description_name, description(rig));
}

Expected<Rig> read_rig(const fs::path& folder) {
  const auto entries = read_description(folder / description_name);
  if (!entries) return tl::unexpected(entries.error());
  Rig rig;
  std::set<std::string> names;
  for (const SensorEntry& entry : entries->sensors) {
    if (!names.insert(entry.name).second)
      return fail(fmt::format("{}: two sensors are named {}.", (folder / description_name).string(), entry.name));
    auto sensor = read_lens(folder, entry);
    if (!sensor) return tl::unexpected(sensor.error());
    if (!entry.lens_of.empty()) {
      sensor->lens_of = rig.find(entry.lens_of);
      if (!sensor->lens_of || rig.sensors[*sensor->lens_of].lens_of ||
          rig.sensors[*sensor->lens_of].lens.parameters() != sensor->lens.parameters()) {
        return fail(fmt::format("{}: {} is said to have the lens of {}, which is not so, or is not a sensor before it.",
                                (folder / description_name).string(), entry.name, entry.lens_of));
      }
    }
    rig.sensors.push_back(std::move(*sensor));
  }
  for (const Led& led : entries->leds)
    if (!names.insert(led.name).second)
      return fail(fmt::format("{}: an LED and a sensor, or two LEDs, are named {}.",
                              (folder / description_name).string(), led.name));
  rig.leds = entries->leds;
  rig.sigma_px = entries->sigma_px;
  rig.scale_lacks = entries->scale_lacks;
  rig.doubts = entries->doubts;
  rig.rejected = entries->rejected;
  if (entries->covariance_file.empty()) return rig;
  auto matrix = read_npy(folder / entries->covariance_file);
  if (!matrix) return tl::unexpected(matrix.error());
  rig.covariance = {entries->covariance_rows, std::move(*matrix)};
  if (auto sound = check_covariance(rig.covariance); !sound)
    return fail(fmt::format("{}, whose rows {} names: {}.", (folder / covariance_name).string(), description_name,
                            sound.error().message));
  return rig;
}

}  // namespace crumple
