#include "cli/calibrate_hand_eye.h"

#include <algorithm>
#include <chrono>
#include <optional>
#include <utility>

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
DEFINE_bool(paired, false, "with --hand_eye: the poses of both files belong together line by line; no times are used");

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

bool is_inverted(const std::string& role) {
  const std::vector<std::string> inverted = parse_names(FLAGS_invert);
  return std::find(inverted.begin(), inverted.end(), role) != inverted.end();
}

Expected<PoseStream> read_stream(const std::string& file, const std::string& role) {
  auto stream = read_pose_stream(file);
  if (!stream || !is_inverted(role)) return stream;
  std::vector<StampedPose> poses = stream->poses();
  for (StampedPose& pose : poses) pose.fixed_from_moving = pose.fixed_from_moving.inverse();
  return PoseStream::create(poses);
}

Expected<std::vector<Pose>> read_list(const std::string& file, const std::string& role) {
  auto poses = read_pose_list(file);
  if (!poses || !is_inverted(role)) return poses;
  for (Pose& pose : *poses) pose = pose.inverse();
  return poses;
}

Expected<std::optional<PairedStreams>> read_streams(const std::string& hand_file, const std::string& eye_file) {
  auto hand = read_stream(hand_file, "hand");
  if (!hand) return tl::unexpected(hand.error());
  auto eye = read_stream(eye_file, "eye");
  if (!eye) return tl::unexpected(eye.error());
  return std::optional<PairedStreams>(std::in_place, std::move(*hand), std::move(*eye));
}

// --paired.
Expected<std::vector<PosePair>> read_pairs(const std::string& hand_file, const std::string& eye_file) {
  const auto hand = read_list(hand_file, "hand");
  if (!hand) return tl::unexpected(hand.error());
  const auto eye = read_list(eye_file, "eye");
  if (!eye) return tl::unexpected(eye.error());
  if (hand->size() != eye->size()) {
    return fail(fmt::format("{} has {} poses and {} has {}: with --paired they belong together line by line", hand_file,
                            hand->size(), eye_file, eye->size()));
  }
  std::vector<PosePair> pairs;
  for (std::size_t i = 0; i < hand->size(); ++i) {
    pairs.push_back({static_cast<double>(i), (*hand)[i], (*eye)[i], {}, {}});
  }
  return pairs;
}

}  // namespace

Expected<VerbResult> run_calibrate_hand_eye(const VerbContext& context) {
  const auto began = std::chrono::steady_clock::now();
  if (context.inputs.size() != 2) {
    return usage_error("--hand_eye takes two files: the hand's poses and the eye's");
  }
  if (const auto sound = check_flags(); !sound) return usage_error(sound.error().message);
  const std::string &hand = context.inputs[0], &eye = context.inputs[1];
  const auto pairs = FLAGS_paired ? read_pairs(hand, eye) : Expected<std::vector<PosePair>>();
  if (!pairs) return tl::unexpected(pairs.error());
  const auto streams = FLAGS_paired ? Expected<std::optional<PairedStreams>>() : read_streams(hand, eye);
  if (!streams) return tl::unexpected(streams.error());
  auto folder = OutputFolder::create(FLAGS_out, FLAGS_overwrite);
  if (!folder) return tl::unexpected(folder.error());
  const auto calibration = *streams ? calibrate_hand_eye(**streams) : calibrate_hand_eye(*pairs);
  if (!calibration) {
    return fail(fmt::format("{} and {}: {}", hand, eye, calibration.error().message));
  }
  const HandEyeVerdict verdict = judge(*calibration);
  VerbResult result;
  result.exit_code = verdict.ok ? ExitCode::done : ExitCode::not_trusted;
  result.document = hand_eye_summary(*calibration, *streams, verdict);
  result.text = hand_eye_text(*calibration, verdict);
  result.document["seconds"] = std::chrono::duration<double>(std::chrono::steady_clock::now() - began).count();
  const auto summary = json_text(result.document);
  if (!summary) return tl::unexpected(summary.error());
  if (auto done = write_hand_eye(folder->path(), calibration->fit); !done) return tl::unexpected(done.error());
  if (auto done = write_file(*folder / "summary.json", *summary); !done) return tl::unexpected(done.error());
  if (auto done = commit_with_record(*folder, context, {hand, eye}); !done) {
    return tl::unexpected(done.error());
  }
  return result;
}

}  // namespace crumple
