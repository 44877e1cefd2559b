// The marked points of a target in an image, sub-pixel, each with its index on the board.
//
// Chessboards: calib/detect_board.h. Coded targets: calib/detect_coded.h. Dots: calib/detect_dots.h.
#pragma once

#include <cstddef>

#include <opencv2/core/mat.hpp>

#include "calib/detect_board.h"
#include "calib/target.h"
#include "solvers/expected.h"

namespace crumple {

// `image` is single-channel, CV_8U or CV_16U. The error is a reason without the image's name.
Expected<DetectedBoard> detect_target(const cv::Mat& image, const Target& target);

// The same where so many boards may be in view: of several, a part of one without markers could as well be part of
// another, which is a failure.
Expected<DetectedBoard> detect_target_among(const cv::Mat& image, const Target& target, std::size_t boards_in_view);

}  // namespace crumple
