// measure: a cloud with its stations + what is to be measured -> values with U and budget.
#include <optional>

#include <fmt/format.h>
#include <gflags/gflags.h>

#include "cli/acceptance.h"
#include "cli/flags.h"
#include "cli/measurement.h"
#include "cli/record.h"
#include "cli/rig_doubts.h"
#include "cli/verbs/verbs.h"
#include "datasets/json_text.h"
#include "datasets/output_folder.h"

DEFINE_string(points, "", "file that names points, planes and spheres, and the distances and angles between them");
DEFINE_string(vdi2634, "", "file that describes spheres, ball bars and plates with their certificates");

namespace crumple {
namespace {

Expected<VerbResult> result_of(const std::filesystem::path& folder) {
  VerbResult result;
  if (!FLAGS_points.empty()) {
    const auto plan = read_measuring_plan(FLAGS_points);
    if (!plan) return tl::unexpected(plan.error());
    const auto cloud = MeasuredCloud::read(folder);
    if (!cloud) return tl::unexpected(cloud.error());
    auto report = measurement_report(*cloud, *plan);
    if (!report) return fail(fmt::format("{}: {}", FLAGS_points, report.error().message));
    result.text = std::move(report->text);
    result.document = std::move(report->document);
    tell_doubts(cloud->rig(), result);
    return result;
  }
  const auto plan = read_acceptance_plan(FLAGS_vdi2634);
  if (!plan) return tl::unexpected(plan.error());
  const auto cloud = MeasuredCloud::read(folder);
  if (!cloud) return tl::unexpected(cloud.error());
  auto report = acceptance_report(*cloud, *plan);
  if (!report) return fail(fmt::format("{}: {}", FLAGS_vdi2634, report.error().message));
  result.exit_code = report->accepted ? ExitCode::done : ExitCode::not_trusted;
  result.text = std::move(report->report.text);
  result.document = std::move(report->report.document);
  tell_doubts(cloud->rig(), result);
  return result;
}

Expected<VerbResult> run_measure(const VerbContext& context) {
  if (FLAGS_points.empty() == FLAGS_vdi2634.empty()) {
    return usage_error("measure wants one of --points and --vdi2634: what is to be measured");
  }
  std::optional<OutputFolder> folder;
  if (!FLAGS_out.empty()) {
    auto created = OutputFolder::create(FLAGS_out, FLAGS_overwrite);
    if (!created) return tl::unexpected(created.error());
    folder = std::move(*created);
  }
  auto result = result_of(context.inputs.front());
  if (!result || !folder) return result;
  const std::filesystem::path cloud = context.inputs.front();
  const auto written =
      json_text(result->document)
          .and_then([&](const std::string& text) { return write_file(*folder / "summary.json", text); })
          .and_then([&] {
            return commit_with_record(*folder, context, {cloud, FLAGS_points.empty() ? FLAGS_vdi2634 : FLAGS_points});
          });
  if (!written) return tl::unexpected(written.error());
  return result;
}

}  // namespace

Verb measure_verb() {
  return {
      .name = "measure",
      .purpose = "measure points, distances, angles, planes and spheres in a cloud, with U",
      .usage = "CLOUD --points=FILE.yaml | --vdi2634=FILE.yaml [--flags]",
      .description =
          "CLOUD is the folder that `crumple reconstruct` wrote. Every value is given with its standard uncertainty u, "
          "U (k = 2) and what calibration, the scale's certificate, the stations' poses and decoding have in it, with "
          "what points have in common carried through. --vdi2634 tests against calibrated artefacts after VDI/VDE 2634 "
          "parts 2 and 3: probing error of form and size, sphere-spacing error, length error and flatness, predicted "
          "against observed; exit code 4 where a limit that the file states is exceeded. With --out, summary.json and "
          "a run record are written.",
      .example =
          "$ crumple measure cloud --points=points.yaml\n"
          "distances (mm)                 value        u  U (k=2)   u by    scale calibration  station decoding\n"
          "  left - right              300.0077   0.0193   0.0386          0.0060      0.0018   0.0178   0.0042\n",
      .min_inputs = 1,
      .max_inputs = 1,
      .flags = {"points", "vdi2634", "out", "overwrite", "json"},
      .required = {},
      .run = run_measure};
}

}  // namespace crumple
