// The centres of gravity of a dot target's discs.
//
// OpenCV finds the grid. Which dot is which: x cross y points into the board; where the print looks the same after half
// a turn, x points to the right in the image. All dots must be seen.
//
// A centre is the centre of gravity of what the dot takes from the light around it, 1 - I / white, over a window that
// holds all of the dot and its blur, with `white` a plane fitted to the sheet around it: neither blur nor a light
// gradient moves it. It is *not* the image of the disc's centre: solvers/disc.h predicts it as it is.
#pragma once

#include <opencv2/core/mat.hpp>

#include "calib/detect_board.h"
#include "calib/target.h"
#include "solvers/expected.h"

namespace crumple {

// `image` is single-channel, CV_8U or CV_16U. The error is a reason without the image's name.
Expected<DetectedBoard> detect_dots(const cv::Mat& image, const Target& target);

}  // namespace crumple
