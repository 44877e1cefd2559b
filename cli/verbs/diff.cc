// diff: two rigs -> what differs between them beyond both uncertainties.
#include <filesystem>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <gflags/gflags.h>

#include "cli/difference_files.h"
#include "cli/flags.h"
#include "cli/record.h"
#include "cli/rig_difference_text.h"
#include "cli/verbs/verbs.h"
#include "datasets/output_folder.h"
#include "datasets/recorded_inputs.h"
#include "datasets/rig_file.h"

DEFINE_double(k, 2, "standard uncertainties that a difference must exceed to be significant");
DEFINE_double(near_mm, 0,
              "where the measuring volume begins, from each first sensor; 0: "
              "where the sensors' axes meet");
DEFINE_double(far_mm, 0, "where it ends; needed with --near_mm");

namespace crumple {
namespace {

namespace fs = std::filesystem;

Expected<RigDifferenceOptions> options_of_flags() {
  RigDifferenceOptions options;
  if (!(FLAGS_k > 0)) return fail("--k: must be above 0");
  options.k = FLAGS_k;
  if (FLAGS_near_mm == 0 && FLAGS_far_mm == 0) return options;
  if (!(FLAGS_near_mm > 0 && FLAGS_far_mm > FLAGS_near_mm)) {
    return fail("--near_mm and --far_mm: both are needed, with 0 < near < far");
  }
  options.depth = VolumeDepth{FLAGS_near_mm, FLAGS_far_mm};
  return options;
}

// Why the two calibrations are not independent, which is what their difference is judged by; empty where nothing tells.
std::string link_between(const std::string& a, const std::string& b, const SharedInputs& shared) {
  std::string link;
  if (shared.second_from_first)
    link = fmt::format("{} went on from {} (calibrate --start)", b, a);
  else if (shared.first_from_second)
    link = fmt::format("{} went on from {} (calibrate --start)", a, b);
  else if (!shared.common.empty())
    link = fmt::format("the same files went into both ({} in common, the first {})", shared.common.size(),
                       shared.common.front());
  if (link.empty()) return link;
  return link +
         ": they share errors, so that noise alone differs by less than what is expected here. A change may be missed; "
         "what is significant is so all the more.";
}

Expected<void> write_files(const VerbContext& context, const RigDifference& difference,
                           const nlohmann::json& document) {
  auto folder = OutputFolder::create(FLAGS_out, FLAGS_overwrite);
  if (!folder) return tl::unexpected(folder.error());
  if (auto done = write_difference_files(difference, folder->path()); !done) return done;
  if (auto done = write_file(folder->path() / "summary.json", document.dump(2) + "\n"); !done) return done;
  return commit_with_record(*folder, context, std::vector<fs::path>(context.inputs.begin(), context.inputs.end()));
}

Expected<VerbResult> run_diff(const VerbContext& context) {
  const auto options = options_of_flags();
  if (!options) return usage_error(options.error().message);
  const auto a = read_rig(context.inputs[0]), b = read_rig(context.inputs[1]);
  for (const auto* rig : {&a, &b}) {
    if (!*rig) return tl::unexpected(rig->error());
  }
  const auto difference = rig_difference(*a, *b, *options);
  if (!difference) {
    return fail(fmt::format("{} and {}: {}", context.inputs[0], context.inputs[1], difference.error().message));
  }
  const auto shared = shared_inputs(context.inputs[0], context.inputs[1]);
  if (!shared) return tl::unexpected(shared.error());
  const std::string link = link_between(context.inputs[0], context.inputs[1], *shared);
  VerbResult result;
  result.exit_code = difference->significant() ? ExitCode::not_trusted : ExitCode::done;
  result.text = rig_difference_text(*difference);
  result.document = rig_difference_json(*difference);
  if (!link.empty()) {
    result.text += "not independent: " + link + "\n";
    result.document["not_independent"] = link;
  }
  if (FLAGS_out.empty()) return result;
  if (auto done = write_files(context, *difference, result.document); !done) return tl::unexpected(done.error());
  return result;
}

}  // namespace

Verb diff_verb() {
  return {.name = "diff",
          .purpose = "say what differs between two rigs beyond both uncertainties",
          .usage = "RIG_A RIG_B [--flags]",
          .description =
              "Compares two calibrations of the same sensors, each with its "
              "covariance: how each sensor projects (px "
              "over its image, after the rigid motion of its frame that fits "
              "best), what each pair of sensors "
              "measures in the volume (mm, likewise), the probe's LEDs among each "
              "other and against what carries "
              "them. Expected is what the noise of both calibrations would make of "
              "an unchanged rig; p is the "
              "probability of so large a difference from noise alone. What changed "
              "significantly is named, with exit "
              "code 4. Where the rigs' records tell that one went on from the "
              "other, or that the same files (images, an earlier rig) went into both, that is said. Lens models may "
              "differ. With --out the "
              "differences over "
              "image and volume are written as CSV "
              "and pictures, and summary.json. docs/uncertainty.md has the maths.",
          .example =
              "$ crumple diff spring autumn\n"
              "...\n"
              "changed: proj0 has moved against cam0.\n"
              "significant at k = 2 over 3 tests\n",
          .min_inputs = 2,
          .max_inputs = 2,
          .flags = {"k", "near_mm", "far_mm", "out", "overwrite", "json"},
          .required = {},
          .run = run_diff};
}

}  // namespace crumple
