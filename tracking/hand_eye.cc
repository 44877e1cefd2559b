#include "tracking/hand_eye.h"

#include <algorithm>
#include <numbers>

#include <fmt/format.h>

#include "tracking/median.h"

namespace crumple {
namespace {

constexpr double kContradiction_rad = 0.2;
constexpr std::size_t kShortStream = 100;  // poses

std::vector<PosePair> pairs_at(const PairSource& source, double offset_s) {
  std::vector<PosePair> pairs;
  for (std::size_t i = 0; i < source.size; ++i) {
    if (const auto pair = source.pair(i, offset_s)) pairs.push_back(*pair);
  }
  return pairs;
}

// Where most pairs put the board: coordinate by coordinate the median, and the pair nearest to that gives the rotation.
Pose median_board(const std::vector<PosePair>& pairs, const Pose& hand_from_eye) {
  std::vector<Pose> boards;
  for (const PosePair& pair : pairs) {
    boards.push_back(pair.world_from_hand * hand_from_eye * pair.board_from_eye.inverse());
  }
  Eigen::Vector3d median;
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    std::vector<double> values;
    for (const Pose& board : boards) values.push_back(board.translation[axis]);
    median[axis] = median_of(values);
  }
  const auto nearest = std::min_element(boards.begin(), boards.end(), [&](const Pose& a, const Pose& b) {
    return (a.translation - median).squaredNorm() < (b.translation - median).squaredNorm();
  });
  return {nearest->rotation, median};
}

// With the eye's poses the wrong way round angles still agree and axes do not.
Expected<void> check_sense(const std::vector<PosePair>& pairs, const HandEyeStart& start) {
  if (start.axis_rms_rad < kContradiction_rad) return {};
  std::vector<PosePair> inverted = pairs;
  for (PosePair& pair : inverted) pair.board_from_eye = pair.board_from_eye.inverse();
  const auto other = hand_eye_start(select_motions(inverted).motions);
  if (!other || other->axis_rms_rad > 0.5 * start.axis_rms_rad) return {};
  return fail(
      fmt::format("the second poses fit far better the other way round (axes agree to {:.2g} deg, not {:.2g}): "
                  "they map the fixed frame into the moving one; invert them",
                  other->axis_rms_rad * 180 / std::numbers::pi, start.axis_rms_rad * 180 / std::numbers::pi));
}

Expected<HandEyeCalibration> calibrate_from(const PairSource& source, double offset_s) {
  const std::vector<PosePair> pairs = pairs_at(source, offset_s);
  const SelectedMotions selected = select_motions(pairs);
  HandEyeCalibration calibration;
  calibration.motions = selected.motions.size();
  auto start = hand_eye_start(selected.motions);
  if (!start) return tl::unexpected(start.error());
  if (const auto sense = check_sense(pairs, *start); !sense) return tl::unexpected(sense.error());
  calibration.start = *start;
  const HandEyeState state{start->hand_from_eye, median_board(pairs, start->hand_from_eye), offset_s};
  auto fit = refine_hand_eye(source, state);
  if (!fit) return tl::unexpected(fit.error());
  calibration.fit = std::move(*fit);
  const Pose& pose = calibration.fit.state.hand_from_eye;
  calibration.scatter = board_scatter(calibration.fit.pairs, calibration.fit.accepted, pose);
  calibration.scatter_all = board_scatter(calibration.fit.pairs, {}, pose);
  return calibration;
}

// Short streams, and such of equally many poses, may be lists that belong together by their order.
Error no_offset(const std::string& reason, const PairedStreams& streams) {
  const std::size_t hand = streams.hand().poses().size(), eye = streams.eye().poses().size();
  if (hand != eye && std::min(hand, eye) >= kShortStream) return {reason};
  return {reason + "\nif the poses of both belong together line by line, no times are needed: --paired"};
}

}  // namespace

Expected<HandEyeCalibration> calibrate_hand_eye(const std::vector<PosePair>& pairs) {
  const PairSource source{pairs.size(), false, [&pairs](std::size_t i, double) { return std::optional(pairs[i]); }};
  return calibrate_from(source, 0);
}

Expected<HandEyeCalibration> calibrate_hand_eye(const PairedStreams& streams) {
  const auto offset = estimate_time_offset(streams.hand(), streams.eye());
  if (!offset) return tl::unexpected(no_offset(offset.error().message, streams));
  const PairSource source{streams.size(), true,
                          [&streams](std::size_t i, double offset_s) { return streams.pair(i, offset_s); }};
  auto calibration = calibrate_from(source, offset->offset_s);
  if (calibration) calibration->offset = *offset;
  return calibration;
}

}  // namespace crumple
