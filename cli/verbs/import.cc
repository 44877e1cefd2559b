// import: files of another program's format -> rig.
#include <algorithm>
#include <filesystem>

#include <fmt/format.h>

#include "cli/flags.h"
#include "cli/length_unit.h"
#include "cli/record.h"
#include "cli/verbs/verbs.h"
#include "datasets/formats/rig_format.h"
#include "datasets/output_folder.h"
#include "datasets/rig_file.h"

namespace crumple {
namespace {

constexpr std::size_t kMostFiles = 100;
constexpr double kMmPerM = 1000;

bool has_lengths(const Rig& rig) {
  return std::any_of(rig.sensors.begin(), rig.sensors.end(),
                     [](const Sensor& sensor) { return !sensor.sensor_from_mount.translation.isZero(0); });
}

// The lengths of a format that states its unit are mm already.
Expected<Rig> in_mm(const RigFormat& format, Rig rig, const std::optional<double>& unit_mm) {
  if (!format.lengths.empty() || !has_lengths(rig)) return rig;
  if (unit_mm) return scaled(std::move(rig), *unit_mm);
  return fail(
      fmt::format("--format={} states no unit of length: give --unit=mm, cm or m, of the poses in it", format.name));
}

std::string sensor_line(const Sensor& sensor) {
  const Eigen::Vector3d centre = sensor.sensor_from_mount.inverse().translation;
  return fmt::format("{} ({}): {} x {} px, {:.3f} m from the reference\n", sensor.name, sensor.lens.model(),
                     sensor.lens.size().width_px, sensor.lens.size().height_px, centre.norm() / kMmPerM);
}

nlohmann::json sensors_json(const Rig& rig) {
  nlohmann::json sensors = nlohmann::json::array();
  for (const Sensor& sensor : rig.sensors) {
    sensors.push_back({{"name", sensor.name},
                       {"kind", sensor.kind == SensorKind::camera ? "camera" : "projector"},
                       {"lens_model", sensor.lens.model()},
                       {"distance_mm", sensor.sensor_from_mount.translation.norm()}});
  }
  return sensors;
}

Expected<VerbResult> run_import(const VerbContext& context) {
  const auto format = rig_format(FLAGS_format);
  if (!format) return usage_error("--format: " + format.error().message);
  const auto unit_mm = unit_from_flag(*format);
  if (!unit_mm) return usage_error(unit_mm.error().message);
  const std::vector<std::filesystem::path> inputs(context.inputs.begin(), context.inputs.end());
  auto read = format->read(inputs);
  if (!read) return tl::unexpected(read.error());
  const auto rig = in_mm(*format, std::move(*read), *unit_mm);
  if (!rig) return usage_error(rig.error().message);
  auto folder = OutputFolder::create(FLAGS_out, FLAGS_overwrite);
  if (!folder) return tl::unexpected(folder.error());
  if (auto written = write_rig(folder->path(), *rig); !written) return tl::unexpected(written.error());
  if (auto done = commit_with_record(*folder, context, inputs); !done) return tl::unexpected(done.error());

  VerbResult result;
  for (const Sensor& sensor : rig->sensors) result.text += sensor_line(sensor);
  result.text += "no covariance: what the rig adds to the uncertainty of measurements is unknown\n";
  result.document = {{"out", FLAGS_out}, {"format", format->name}, {"sensors", sensors_json(*rig)}};
  return result;
}

}  // namespace

Verb import_verb() {
  return {
      .name = "import",
      .purpose = "make a rig from the files of another program",
      .usage = "FILE... --format=NAME --out=DIR [--flags]",
      .description =
          "Reads cameras from OpenCV's YAML (one file per camera), Kalibr's camchain, ROS's camera_info (one file, or "
          "two of a stereo pair), a folder of COLMAP's text files, or mrcal's .cameramodel files, and writes a rig "
          "without covariance. The first file's camera becomes the reference; a folder in place of the files stands "
          "for all of them in it. opencv, colmap and mrcal state no unit of length: --unit has to.",
      .example =
          "$ crumple import camchain.yaml --format=kalibr --out=rig\n"
          "left (LENSMODEL_OPENCV4): 752 x 480 px, 0.000 m from the reference\n"
          "right (LENSMODEL_OPENCV4): 752 x 480 px, 0.110 m from the reference\n"
          "no covariance: what the rig adds to the uncertainty of measurements is unknown\n",
      .min_inputs = 1,
      .max_inputs = kMostFiles,
      .flags = {"format", "out", "unit", "overwrite", "json"},
      .required = {"format", "out"},
      .run = run_import};
}

}  // namespace crumple
