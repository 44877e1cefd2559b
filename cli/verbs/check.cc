// check: capture -> what is wrong with it, file by file.
#include <algorithm>

#include <fmt/format.h>
#include <gflags/gflags.h>

#include "calib/rig_check.h"
#include "cli/calibration_input.h"
#include "cli/flags.h"
#include "cli/rig_check_text.h"
#include "cli/sentence.h"
#include "cli/verbs/verbs.h"
#include "datasets/bag.h"
#include "datasets/check_capture.h"
#include "datasets/earlier_rig.h"

DECLARE_string(rig);

namespace crumple {
namespace {

nlohmann::json as_json(const Finding& finding) {
  return {{"severity", finding.severity == Severity::error ? "error" : "warning"},
          {"where", finding.where},
          {"sentence", as_sentences(finding.sentence)}};
}

std::size_t count(const std::vector<Finding>& findings, Severity severity) {
  return static_cast<std::size_t>(std::count_if(findings.begin(), findings.end(),
                                                [&](const Finding& finding) { return finding.severity == severity; }));
}

// By the capture's sensors that the rig knows.
Expected<RigCheck> check_against_rig(const Capture& capture) {
  const auto earlier = read_earlier_rig(FLAGS_rig);
  if (!earlier) return tl::unexpected(earlier.error());
  std::vector<std::string> sensors;
  for (const CaptureSensor& sensor : capture.sensors) {
    if (earlier->rig.find(sensor.name)) sensors.push_back(sensor.name);
  }
  if (sensors.empty()) return fail("the rig knows none of the capture's sensors: it is of something else");
  const auto input =
      read_calibration_input(capture, sensors, ProjectorSource::automatic, thread_count(), NeedsBoards::no);
  if (!input) return tl::unexpected(input.error());
  return check_rig(input->data, *earlier, thread_count());
}

Expected<VerbResult> run_check(const VerbContext& context) {
  std::vector<Finding> findings;
  const auto bag = bag_of(context.inputs.front());
  if (bag) findings = check_bag(*bag);
  const auto capture = read_capture(context.inputs.front(), images_folder());
  if (!capture && findings.empty()) return tl::unexpected(capture.error());
  if (capture) {
    const std::vector<Finding> of_images = check_capture(*capture);
    findings.insert(findings.end(), of_images.begin(), of_images.end());
  } else {
    // What happened to the bag may be the reason.
    findings.push_back({Severity::error, context.inputs.front(), capture.error().message});
  }
  const std::size_t stations = capture ? capture->stations.size() : 0;
  const std::size_t errors = count(findings, Severity::error);
  const std::size_t warnings = count(findings, Severity::warning);
  VerbResult result;
  result.exit_code = errors == 0 ? ExitCode::done : ExitCode::bad_input;
  result.document = {{"capture", context.inputs.front()},
                     {"bag", bag.has_value()},
                     {"stations", stations},
                     {"errors", errors},
                     {"warnings", warnings},
                     {"findings", nlohmann::json::array()}};
  for (const Finding& finding : findings) {
    const char* const severity = finding.severity == Severity::error ? "error" : "warning";
    result.text += fmt::format("{}: {}: {}\n", severity, finding.where, as_sentences(finding.sentence));
    result.document["findings"].push_back(as_json(finding));
  }
  result.text += fmt::format("{} stations, errors: {}, warnings: {}\n", stations, errors, warnings);
  if (FLAGS_rig.empty() || errors > 0) return result;
  const auto rig = check_against_rig(*capture);
  if (!rig) return fail(fmt::format("{} against {}: {}", context.inputs.front(), FLAGS_rig, rig.error().message));
  result.text += rig_check_text(*rig);
  result.document["rig"] = rig_check_json(*rig);
  if (!rig->valid()) result.exit_code = ExitCode::not_trusted;
  return result;
}

}  // namespace

Verb check_verb() {
  return {.name = "check",
          .purpose = "say what is wrong with a capture, file by file",
          .usage = "CAPTURE.yaml [--flags]",
          .description =
              "Verifies every file of a BagIt bag against its manifest, then reads every image of every station that "
              "is not excluded: missing, empty or truncated files, "
              "wrong sizes and depths, dark or saturated frames, frames out of order, stations with the same "
              "images. Exit code 3 where there is an error; warnings alone leave it at 0. With --rig it then asks "
              "whether that "
              "rig is still valid, from the few stations or placements that the capture may hold: what changed (a "
              "tracker that was nudged, a bent LED, a lens) is named, with exit code 4.",
          .example =
              "$ crumple check campaign/capture.yaml\n"
              "error: station 3, camera left: campaign/left/3_07.png does not exist.\n"
              "12 stations, errors: 1, warnings: 0\n",
          .min_inputs = 1,
          .max_inputs = 1,
          .flags = {"images", "rig", "threads", "json"},
          .required = {},
          .run = run_check};
}

}  // namespace crumple
