#include "cli/calibrate_hand_eye.h"

#include <algorithm>
#include <chrono>

#include <fmt/format.h>
#include <gflags/gflags.h>

#include "cli/flags.h"
#include "cli/hand_eye_summary.h"
#include "cli/record.h"
#include "datasets/hand_eye_file.h"
#include "datasets/json_text.h"
#include "datasets/output_folder.h"
#include "datasets/pose_csv.h"

DEFINE_string(invert, "",
              "with --hand_eye, whose poses map the fixed frame into the moving one and are to be inverted: hand, eye, "
              "or hand,eye");

namespace crumple {
namespace {

// What calibrate takes that has no meaning for poses.
constexpr const char* kCaptureFlags[] = {"images",  "sensors",        "warp",     "projector_from", "outliers",
                                         "lens",    "cross_validate", "overlays", "truth",          "start",
                                         "correct", "threads",        "report",   "starts",         "suggest"};

Expected<void> check_flags() {
  for (const char* name : kCaptureFlags) {
    gflags::CommandLineFlagInfo info;
    if (gflags::GetCommandLineFlagInfo(name, &info) && !info.is_default) {
      return fail(fmt::format("--{} is about captures; leave it out with --hand_eye", name));
    }
  }
  for (const std::string& name : parse_names(FLAGS_invert)) {
    if (name != "hand" && name != "eye") return fail(fmt::format("--invert={} is neither hand nor eye", name));
  }
  return {};
}

Expected<PoseStream> read_stream(const std::string& file, const std::string& role) {
  auto stream = read_pose_stream(file);
  const std::vector<std::string> inverted = parse_names(FLAGS_invert);
  if (!stream || std::find(inverted.begin(), inverted.end(), role) == inverted.end()) return stream;
  std::vector<StampedPose> poses = stream->poses();
  for (StampedPose& pose : poses) pose.fixed_from_moving = pose.fixed_from_moving.inverse();
  return PoseStream::create(poses);
}

}  // namespace

Expected<VerbResult> run_calibrate_hand_eye(const VerbContext& context) {
  const auto began = std::chrono::steady_clock::now();
  if (context.inputs.size() != 2) {
    return usage_error("--hand_eye takes two files: the hand's poses and the eye's");
  }
  if (const auto sound = check_flags(); !sound) return usage_error(sound.error().message);
  auto hand = read_stream(context.inputs[0], "hand");
  if (!hand) return tl::unexpected(hand.error());
  auto eye = read_stream(context.inputs[1], "eye");
  if (!eye) return tl::unexpected(eye.error());
  auto folder = OutputFolder::create(FLAGS_out, FLAGS_overwrite);
  if (!folder) return tl::unexpected(folder.error());
  const PairedStreams streams(std::move(*hand), std::move(*eye));
  const auto calibration = calibrate_hand_eye(streams);
  if (!calibration) {
    return fail(fmt::format("{} and {}: {}", context.inputs[0], context.inputs[1], calibration.error().message));
  }
  const HandEyeVerdict verdict = judge(*calibration);
  VerbResult result;
  result.exit_code = verdict.ok ? ExitCode::done : ExitCode::not_trusted;
  result.document = hand_eye_summary(*calibration, streams, verdict);
  result.text = hand_eye_text(*calibration, verdict);
  result.document["seconds"] = std::chrono::duration<double>(std::chrono::steady_clock::now() - began).count();
  const auto summary = json_text(result.document);
  if (!summary) return tl::unexpected(summary.error());
  if (auto done = write_hand_eye(folder->path(), calibration->fit); !done) return tl::unexpected(done.error());
  if (auto done = write_file(*folder / "summary.json", *summary); !done) return tl::unexpected(done.error());
  if (auto done = commit_with_record(*folder, context, {context.inputs[0], context.inputs[1]}); !done) {
    return tl::unexpected(done.error());
  }
  return result;
}

}  // namespace crumple
