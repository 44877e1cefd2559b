#include "tests/tracking/real_comparison.h"

#include <algorithm>

#include "datasets/pose_csv.h"
#include "tests/tracking/opencv_hand_eye.h"

namespace crumple {
namespace {

std::vector<PosePair> every(std::size_t step, const std::vector<PosePair>& pairs) {
  std::vector<PosePair> some;
  for (std::size_t i = 0; i < pairs.size(); i += step) some.push_back(pairs[i]);
  return some;
}

std::vector<PosePair> accepted_pairs(const HandEyeFit& fit) {
  std::vector<PosePair> accepted;
  for (std::size_t i = 0; i < fit.pairs.size(); ++i) {
    if (fit.accepted[i] != 0) accepted.push_back(fit.pairs[i]);
  }
  return accepted;
}

std::vector<PosePair> calm_pairs(const HandEyeFit& fit) {
  std::vector<double> speeds{0};
  for (std::size_t i = 1; i < fit.pairs.size(); ++i) {
    const PosePair& pair = fit.pairs[i];
    const PosePair& last = fit.pairs[i - 1];
    speeds.push_back(pair.board_from_eye.rotation.angularDistance(last.board_from_eye.rotation) /
                     (pair.time_s - last.time_s));
  }
  std::vector<double> sorted = speeds;
  std::sort(sorted.begin(), sorted.end());
  std::vector<PosePair> calm;
  for (std::size_t i = 0; i < fit.pairs.size(); ++i) {
    if (speeds[i] < sorted[3 * sorted.size() / 10]) calm.push_back(fit.pairs[i]);
  }
  return calm;
}

Expected<PairSetComparison> compare(const std::string& name, const std::vector<PosePair>& pairs,
                                    const Pose& by_streams) {
  PairSetComparison comparison{name, {}};
  const auto add = [&](const std::string& method, const Pose& pose) {
    comparison.methods.push_back({method, pose, board_scatter(pairs, {}, pose)});
  };
  const auto own = calibrate_hand_eye(pairs);
  if (!own) return tl::unexpected(own.error());
  add("Crumple, these pairs", own->fit.state.hand_from_eye);
  add("Crumple, all pairs", by_streams);
  for (std::size_t m = 0; m < kOpencvHandEyeMethods.size(); ++m) {
    add("OpenCV " + kOpencvHandEyeMethods[m], opencv_hand_eye(pairs, m));
  }
  return comparison;
}

}  // namespace

Expected<RealComparison> compare_on_recording(const RealHandEye& set, const std::filesystem::path& unpacked) {
  auto hand = read_pose_stream(unpacked / set.hand), eye = read_pose_stream(unpacked / set.eye);
  if (!hand) return tl::unexpected(hand.error());
  if (!eye) return tl::unexpected(eye.error());
  auto calibration = calibrate_hand_eye(PairedStreams(*hand, *eye));
  if (!calibration) return tl::unexpected(calibration.error());
  RealComparison result{*calibration, {}};
  const Pose& pose = calibration->fit.state.hand_from_eye;
  const std::vector<PosePair> accepted = every(5, accepted_pairs(calibration->fit));
  const std::vector<PosePair> calm = every(6, calm_pairs(calibration->fit));
  for (const auto& [name, pairs] : {std::pair("accepted", accepted), std::pair("calm", calm)}) {
    auto comparison = compare(name, pairs, pose);
    if (!comparison) return tl::unexpected(comparison.error());
    result.sets.push_back(*comparison);
  }
  return result;
}

}  // namespace crumple
