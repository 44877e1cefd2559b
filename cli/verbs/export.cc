// export: rig -> files of another program's format.
#include <algorithm>
#include <filesystem>

#include <fmt/format.h>

#include "cli/flags.h"
#include "cli/length_unit.h"
#include "cli/record.h"
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

Expected<VerbResult> run_export(const VerbContext& context) {
  const auto format = rig_format(FLAGS_format);
  if (!format) return usage_error("--format: " + format.error().message);
  const auto unit_mm = unit_from_flag(*format);
  if (!unit_mm) return usage_error(unit_mm.error().message);
  const std::filesystem::path rig_folder = context.inputs.front();
  auto rig = read_rig(rig_folder);
  if (!rig) return tl::unexpected(rig.error());
  auto record = read_calibration_record(rig_folder);
  if (!record) return tl::unexpected(record.error());
  auto folder = OutputFolder::create(FLAGS_out, FLAGS_overwrite);
  if (!folder) return tl::unexpected(folder.error());

  const auto lost = format->write({std::move(*rig), std::move(*record), unit_mm->value_or(1)}, folder->path());
  if (!lost) return fail(fmt::format("{}: {}", rig_folder.string(), lost.error().message));
  const std::vector<std::string> files = files_in(folder->path());
  if (auto done = commit_with_record(*folder, context, {rig_folder}); !done) return tl::unexpected(done.error());

  VerbResult result;
  for (const std::string& file : files)
    result.text += fmt::format("{}\n", (std::filesystem::path(FLAGS_out) / file).string());
  for (const std::string& sentence : *lost) result.text += fmt::format("left behind: {}\n", sentence);
  result.document = {{"out", FLAGS_out}, {"format", format->name}, {"files", files}, {"left_behind", *lost}};
  return result;
}

}  // namespace

Verb export_verb() {
  return {.name = "export",
          .purpose = "write a rig in the format of another program",
          .usage = "RIG --format=NAME --out=DIR [--flags]",
          .description =
              "Writes the rig's cameras for OpenCV (cv::FileStorage), Kalibr (camchain), ROS (camera_info), COLMAP "
              "(text) or mrcal (.cameramodel, with the optimization's inputs where the rig's folder holds its "
              "observations). A lens that the format cannot hold stops the export; what else it has no place for is "
              "listed as left behind. Lengths of kalibr and ros are m; of the others mm, or as --unit says. "
              "docs/formats.md says what each holds.",
          .example =
              "$ crumple export rig --format=kalibr --out=camchain\n"
              "camchain/camchain.yaml\n"
              "left behind: projector proj0: the format knows cameras only\n"
              "left behind: the covariance of the rig\n"
              "left behind: the noise of the observations (sigma_px)\n",
          .min_inputs = 1,
          .max_inputs = 1,
          .flags = {"format", "out", "unit", "overwrite", "json"},
          .required = {"format", "out"},
          .run = run_export};
}

}  // namespace crumple
