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

}  // namespace crumple
