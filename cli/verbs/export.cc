// export: rig -> files of another program's format.
#include <algorithm>
#include <filesystem>
#include <optional>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "cli/flags.h"
#include "cli/length_unit.h"
#include "cli/record.h"
#include "cli/rig_doubts.h"
#include "cli/verbs/verbs.h"
#include "datasets/calibration_record.h"
#include "datasets/formats/rig_format.h"
#include "datasets/output_folder.h"
#include "datasets/rig_file.h"

namespace crumple {
namespace {

std::vector<std::string> files_in(const std::filesystem::path& folder) {
  std::vector<std::string> names;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) names.push_back(entry.path().filename());
  std::sort(names.begin(), names.end());
  return names;
}

std::string names_on(const Rig& rig, Mount mount) {
  std::vector<std::string> names;
  for (const Sensor& sensor : rig.sensors) {
    if (sensor.mount == mount) names.push_back(sensor.name);
  }
  return fmt::format("{}", fmt::join(names, ", "));
}

// The rig with the sensors of one mount: of those on the probe and those fixed to the world no pose is common.
Expected<Rig> on_one_mount(Rig rig, const std::optional<Mount>& wanted) {
  const std::string on_probe = names_on(rig, Mount::probe), in_world = names_on(rig, Mount::world);
  if (!wanted && !on_probe.empty() && !in_world.empty()) {
    return fail(fmt::format(
        "{} on the probe and {} fixed to the world have no frame in common for their poses. Write one or the "
        "other, by --mount=probe or --mount=world",
        on_probe, in_world));
  }
  const Mount mount = wanted.value_or(on_probe.empty() ? Mount::world : Mount::probe);
  std::erase_if(rig.sensors, [&](const Sensor& sensor) { return sensor.mount != mount; });
  for (Sensor& sensor : rig.sensors) sensor.lens_of.reset();  // each is written with its own copy
  if (rig.sensors.empty()) {
    return fail(fmt::format("no sensor is {}", mount == Mount::probe ? "on the probe" : "fixed to the world"));
  }
  return rig;
}

Expected<VerbResult> run_export(const VerbContext& context) {
  const auto format = rig_format(FLAGS_format);
  if (!format) return usage_error("--format: " + format.error().message);
  const auto unit_mm = unit_from_flag(*format);
  if (!unit_mm) return usage_error(unit_mm.error().message);
  std::optional<Mount> mount;
  if (FLAGS_mount == "probe") mount = Mount::probe;
  if (FLAGS_mount == "world") mount = Mount::world;
  if (!mount && !FLAGS_mount.empty()) return usage_error("--mount: it is probe or world");
  const std::filesystem::path rig_folder = context.inputs.front();
  auto rig = read_rig(rig_folder);
  if (!rig) return tl::unexpected(rig.error());
  const Rig whole = *rig;
  auto record = read_calibration_record(rig_folder);
  if (!record) return tl::unexpected(record.error());
  auto sensors = on_one_mount(std::move(*rig), mount);
  if (!sensors) return fail(fmt::format("{}: {}", rig_folder.string(), sensors.error().message));
  auto folder = OutputFolder::create(FLAGS_out, FLAGS_overwrite);
  if (!folder) return tl::unexpected(folder.error());

  const auto lost = format->write({std::move(*sensors), std::move(*record), unit_mm->value_or(1)}, folder->path());
  if (!lost) return fail(fmt::format("{}: {}", rig_folder.string(), lost.error().message));
  const std::vector<std::string> files = files_in(folder->path());
  if (auto done = commit_with_record(*folder, context, {rig_folder}); !done) return tl::unexpected(done.error());

  VerbResult result;
  for (const std::string& file : files)
    result.text += fmt::format("{}\n", (std::filesystem::path(FLAGS_out) / file).string());
  for (const std::string& sentence : *lost) result.text += fmt::format("left behind: {}\n", sentence);
  result.document = {{"out", FLAGS_out}, {"format", format->name}, {"files", files}, {"left_behind", *lost}};
  tell_doubts(whole, result);
  return result;
}

}  // namespace

Verb export_verb() {
  return {
      .name = "export",
      .purpose = "write a rig in the format of another program",
      .usage = "RIG --format=NAME --out=DIR [--flags]",
      .description =
          "Writes the rig's cameras for OpenCV (cv::FileStorage), Kalibr (camchain), ROS (camera_info), COLMAP "
          "(text) or mrcal (.cameramodel, with the optimization's inputs where the rig's folder holds its "
          "observations). A lens that the format cannot hold stops the export; what else it has no place for is "
          "listed as left behind. Lengths of kalibr and ros are m; of the others mm, or as --unit says. "
          "Of a tracked rig either the sensors on the probe or those fixed to the world are written (--mount): no pose "
          "between them is fixed. docs/formats.md says what each format holds.",
      .example =
          "$ crumple export rig --format=kalibr --out=camchain\n"
          "camchain/camchain.yaml\n"
          "left behind: projector proj0: the format knows cameras only\n"
          "left behind: the covariance of the rig\n"
          "left behind: the noise of the observations (sigma_px)\n",
      .min_inputs = 1,
      .max_inputs = 1,
      .flags = {"format", "out", "mount", "unit", "overwrite", "json"},
      .required = {"format", "out"},
      .run = run_export};
}

}  // namespace crumple
