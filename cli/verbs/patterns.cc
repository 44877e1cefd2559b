// patterns: projector size and stripe orientations -> images to project.
#include <cmath>

#include <fmt/core.h>
#include <gflags/gflags.h>

#include "cli/flags.h"
#include "cli/progress.h"
#include "cli/verbs/verbs.h"
#include "datasets/output_folder.h"
#include "datasets/pattern_files.h"

DEFINE_int32(width_px, 0, "width of the projector's panel, px");
DEFINE_int32(height_px, 0, "height of the projector's panel, px");
DEFINE_string(orientations_deg, "0,90",
              "angles of the stripe coordinate from the panel's x axis towards y, deg: 0 makes columns, 90 rows");
DEFINE_double(stripe_width_px, 1, "width of the finest stripes, px");
DEFINE_int32(bits, 0, "bits per orientation; 0: as few as name every stripe");
DEFINE_int32(code_offset, 0, "added to each stripe's number before it is coded");
DEFINE_bool(inverse, true, "follow each pattern by its inverse");

namespace crumple {
namespace {

Expected<std::vector<StripeOrientation>> orientations_from_flags(ImageSize projector) {
  const auto angles_deg = parse_numbers("orientations_deg", FLAGS_orientations_deg);
  if (!angles_deg) return tl::unexpected(angles_deg.error());
  std::vector<StripeOrientation> orientations;
  for (const double angle_deg : *angles_deg) {
    StripeOrientation orientation{angle_deg * M_PI / 180, FLAGS_stripe_width_px, FLAGS_bits, FLAGS_code_offset,
                                  FLAGS_inverse};
    if (FLAGS_bits == 0) {
      const auto bits = sufficient_bits(orientation, projector);
      if (!bits) return tl::unexpected(bits.error());
      orientation.bits = *bits;
    }
    const auto sound = checked(orientation, projector);
    if (!sound) return tl::unexpected(sound.error());
    orientations.push_back(*sound);
  }
  return orientations;
}

VerbResult summary(const std::vector<StripeOrientation>& orientations, const std::vector<std::string>& files) {
  VerbResult result;
  result.text = fmt::format("{} images in {}\n", files.size(), FLAGS_out);
  result.document = {{"out", FLAGS_out}, {"files", files}, {"orientations", nlohmann::json::array()}};
  for (const StripeOrientation& orientation : orientations) {
    const double angle_deg = orientation.angle_rad * 180 / M_PI;
    result.text += fmt::format("  {:6.2f} deg: {} bits, stripes of {:g} px\n", angle_deg, orientation.bits,
                               orientation.stripe_width_px);
    result.document["orientations"].push_back({{"angle_deg", angle_deg}, {"bits", orientation.bits}});
  }
  return result;
}

Expected<VerbResult> run(const VerbContext&) {
  const ImageSize projector{FLAGS_width_px, FLAGS_height_px};
  const auto orientations = orientations_from_flags(projector);
  if (!orientations) return usage_error(orientations.error().message);
  auto folder = OutputFolder::create(FLAGS_out, FLAGS_overwrite);
  if (!folder) return tl::unexpected(folder.error());
  Progress progress("drawing", pattern_sequence(*orientations).size());
  const auto files = write_patterns(folder->path(), *orientations, projector, [&] { progress.advance(); });
  if (!files) return tl::unexpected(files.error());
  if (auto committed = folder->commit(); !committed) return tl::unexpected(committed.error());
  return summary(*orientations, *files);
}

}  // namespace

Verb patterns_verb() {
  return {.name = "patterns",
          .purpose = "draw the stripe images a projector is to show",
          .usage = "--width_px=N --height_px=N --out=DIR [--flags]",
          .description = "",
          .example =
              "$ crumple patterns --width_px=1024 --height_px=768 --out=patterns\n"
              "42 images in patterns\n"
              "    0.00 deg: 10 bits, stripes of 1 px\n"
              "   90.00 deg: 10 bits, stripes of 1 px\n",
          .min_inputs = 0,
          .max_inputs = 0,
          .flags = {"out", "width_px", "height_px", "orientations_deg", "stripe_width_px", "bits", "code_offset",
                    "inverse", "overwrite", "json"},
          .required = {"out", "width_px", "height_px"},
          .run = run};
}

}  // namespace crumple
