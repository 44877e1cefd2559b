#include "datasets/board_check.h"

#include <algorithm>

#include <fmt/format.h>
#include <opencv2/core.hpp>

#include "calib/detect_target.h"
#include "calib/stripe_observations.h"

namespace crumple {
namespace {

using Kind = FrameContent::Kind;

constexpr double kBoardLit = 0.02;  // of full scale; a board's dark squares return little light
constexpr double kLeastBoardLit = 0.05;

const ShownFrame* find(const std::vector<ShownFrame>& frames, Kind kind) {
  const auto found = std::find_if(frames.begin(), frames.end(), [kind](const ShownFrame& frame) {
    return frame.content.kind == kind && !frame.image.empty();
  });
  return found == frames.end() ? nullptr : &*found;
}

}  // namespace

std::vector<Finding> check_board(const std::vector<ShownFrame>& frames, const BoardSpec& board,
                                 std::size_t boards_in_view, double full_scale, const std::string& where) {
  const ShownFrame* white = find(frames, Kind::white);
  const ShownFrame* ambient = find(frames, Kind::ambient);
  const ShownFrame* black = find(frames, Kind::black);
  const ShownFrame* shown = white != nullptr ? white : ambient;
  if (shown == nullptr) return {};
  auto detected = detect_target_among(shown->image, board.target, boards_in_view);
  std::vector<Finding> left_out;
  if (!detected) {
    left_out.push_back(
        {Severity::warning, where,
         fmt::format("the board's view in {} will not be used: {}", shown->name, detected.error().message)});
  }
  // Whether the projector lights it may be told from where room light shows it; a calibration does not look there.
  if (!detected && white != nullptr && ambient != nullptr) detected = detect_target(ambient->image, board.target);
  if (!detected || white == nullptr || black == nullptr) return left_out;
  const cv::Mat mask = corner_hull(detected->pixels, white->image.size());
  cv::Mat difference;
  cv::subtract(white->image, black->image, difference, cv::noArray(), CV_32F);
  const cv::Mat lit = (difference > kBoardLit * full_scale) & mask;
  const double share = cv::countNonZero(lit) / std::max(1.0, static_cast<double>(cv::countNonZero(mask)));
  if (share >= kLeastBoardLit) return left_out;
  return {{Severity::error, where,
           fmt::format("the projector lights none of the board: {} is brighter than {} on {:.1f} % of its area; aim "
                       "the projector at the board",
                       white->name, black->name, 100 * share)}};
}

}  // namespace crumple
