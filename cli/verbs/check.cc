// check: capture -> what is wrong with it, file by file.
#include <algorithm>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <gflags/gflags.h>

#include "calib/rig_check.h"
#include "cli/calibration_input.h"
#include "cli/flags.h"
#include "cli/record.h"
#include "cli/rig_check_text.h"
#include "cli/sentence.h"
#include "cli/verbs/verbs.h"
#include "datasets/bag.h"
#include "datasets/check_capture.h"
#include "datasets/earlier_rig.h"

DECLARE_string(rig);

namespace crumple {
namespace {

namespace fs = std::filesystem;

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

// Whether a folder is another or lies in it, links followed.
bool lies_in(const fs::path& folder, const fs::path& whole) {
  std::error_code missing;
  const fs::path below = fs::canonical(folder, missing).lexically_relative(fs::canonical(whole, missing));
  return !below.empty() && *below.begin() != "..";
}

// The folder that --bag makes a bag of. Fails where the capture does not lie in it as a bag's payload does, and where
// it has tags already that are to stay: nobody's files are moved or replaced unasked.
Expected<fs::path> folder_to_bag(const Capture& capture) {
  const std::string description = capture.description.string();
  const auto bag = bag_around(capture.description);
  if (!bag) {
    return fail(
        fmt::format("--bag: {} does not lie in a folder named data: a bag has the capture in data/ and the digests of "
                    "its files beside that, so put description and images into such a folder",
                    description));
  }
  if (!lies_in(capture.images, *bag / "data")) {
    return fail(fmt::format("--bag: the images of {} lie in {}: a bag holds them in {}", description,
                            capture.images.string(), (*bag / "data").string()));
  }
  const auto tags = bag_tags_in(*bag);
  if (!tags) return tl::unexpected(tags.error());
  if (!tags->empty() && !FLAGS_overwrite) {
    return fail(fmt::format("--bag: {} has a bag's tag files already ({}); --overwrite replaces them", bag->string(),
                            fmt::join(*tags, ", ")));
  }
  return *bag;
}

Expected<void> make_bag(const fs::path& bag, const Capture& capture, VerbResult& result) {
  const auto tags =
      write_bag_tags(bag, {capture.title, date_of_run(), capture.record.operator_name, capture.record.date});
  if (!tags) return fail("--bag: " + tags.error().message);
  result.text += fmt::format("written to {}, which is a bag now: {}\n", bag.string(), fmt::join(*tags, ", "));
  result.document["bag"] = true;
  result.document["written"] = *tags;
  return {};
}

Expected<void> add_rig_check(const Capture& capture, const std::string& name, VerbResult& result) {
  const auto rig = check_against_rig(capture);
  if (!rig) return fail(fmt::format("{} against {}: {}", name, FLAGS_rig, rig.error().message));
  result.text += rig_check_text(*rig);
  result.document["rig"] = rig_check_json(*rig);
  if (!rig->valid()) result.exit_code = ExitCode::not_trusted;
  return {};
}

Expected<VerbResult> run_check(const VerbContext& context) {
  if (FLAGS_overwrite && !FLAGS_bag) return usage_error("check replaces nothing without --bag");
  const auto capture = read_capture(context.inputs.front(), images_folder());
  std::optional<fs::path> to_bag;
  if (FLAGS_bag && capture) {
    const auto folder = folder_to_bag(*capture);
    if (!folder) return tl::unexpected(folder.error());
    to_bag = *folder;
  }
  std::vector<Finding> findings;
  const auto bag = bag_of(context.inputs.front());
  if (bag) findings = check_bag(*bag);
  if (!capture && findings.empty()) return tl::unexpected(capture.error());
  // What the tags to be replaced say is news, and no reason against new ones.
  if (to_bag) {
    for (Finding& finding : findings) finding.severity = Severity::warning;
  }
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
  if (errors > 0) {
    if (FLAGS_bag) result.text += "no bag is made before the errors are put right\n";
    return result;
  }
  if (!FLAGS_rig.empty()) {
    if (auto added = add_rig_check(*capture, context.inputs.front(), result); !added) {
      return tl::unexpected(added.error());
    }
  }
  if (to_bag) {
    if (auto made = make_bag(*to_bag, *capture, result); !made) return tl::unexpected(made.error());
  }
  return result;
}

}  // namespace

Verb check_verb() {
  return {.name = "check",
          .purpose = "say what is wrong with a capture, file by file",
          .usage = "CAPTURE.yaml [--flags]",
          .description =
              "Verifies every file of a BagIt bag against its manifests, then reads every image of every station that "
              "is not excluded: missing, empty or truncated files, "
              "wrong sizes and depths, dark or saturated frames, frames out of order, stations with the same "
              "images. Exit code 3 where there is an error; warnings alone leave it at 0. With --rig it then asks "
              "whether that "
              "rig is still valid, from the few stations or placements that the capture may hold: what changed (a "
              "tracker that was nudged, a bent LED, a lens) is named, with exit code 4. With --bag a capture "
              "without errors becomes a bag: description and images have to lie in a folder named data, the tag files "
              "are written beside that, and nothing is moved. Tag files that are there already stay unless "
              "--overwrite is given; what they say against the capture's files is a warning then.",
          .example =
              "$ crumple check campaign/capture.yaml\n"
              "error: station 3, camera left: campaign/left/3_07.png does not exist.\n"
              "12 stations, errors: 1, warnings: 0\n",
          .min_inputs = 1,
          .max_inputs = 1,
          .flags = {"images", "rig", "bag", "threads", "overwrite", "json"},
          .required = {},
          .run = run_check};
}

}  // namespace crumple
