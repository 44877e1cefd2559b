#include "calib/detect_target.h"

#include "calib/detect_coded.h"
#include "calib/detect_dots.h"

namespace crumple {

Expected<DetectedBoard> detect_target(const cv::Mat& image, const Target& target) {
  switch (target.kind) {
    case TargetKind::chessboard:
      return detect_grid(image, target.columns, target.rows);
    case TargetKind::charuco:
    case TargetKind::apriltag:
      return detect_coded(image, target);
    case TargetKind::dots:
      break;
  }
  return detect_dots(image, target);
}

Expected<DetectedBoard> detect_target_among(const cv::Mat& image, const Target& target, std::size_t boards_in_view) {
  Expected<DetectedBoard> found = detect_target(image, target);
  if (!found || boards_in_view < 2 || is_coded(target.kind)) return found;
  const int seen = static_cast<int>(found->corners.size()) + found->unrefined;
  if (seen < board_of(target).point_count()) {
    return fail("only part of it is seen, which could be part of another board: use coded boards, or show it whole");
  }
  return found;
}

}  // namespace crumple
