// The corners of coded targets: ChArUco boards and grids of AprilTags.
//
// OpenCV finds and reads the markers; those that do not lie on one plane as the target says are dropped. A marker says
// which corners are near it, so any part of a board will do, and several boards may be in one image. Where a
// corner lies follows from the markers beside it to a pixel or so, and from the fit of calib/refine_corner.h to its
// end.
#pragma once

#include <opencv2/core/mat.hpp>

#include "calib/detect_board.h"
#include "calib/target.h"
#include "solvers/expected.h"

namespace crumple {

// `image` is single-channel, CV_8U or CV_16U. The error is a reason without the image's name: no marker of the
// dictionary, none of this target's, markers where the target has none, of another size.
Expected<DetectedBoard> detect_coded(const cv::Mat& image, const Target& target);

}  // namespace crumple
