// A chessboard image with the lighting divided out, so that corners are found without bias.
//
// A brightness gradient moves the detector's corners towards the brighter side: by 0.04 px in the mean and up to 0.08
// on a projector-lit board in simulation, the same way all over a view, which no sigma would show. The brightness of
// the dark and of the light squares is sampled at the squares' centres, two quadratics in the pixel are fitted, and
// every pixel is set between them.
#pragma once

#include <vector>

#include <Eigen/Core>
#include <opencv2/core/mat.hpp>

namespace crumple {

// `image` is single-channel, CV_8U or CV_16U; `corners` a grid of at least 4 x 4, row by row. The result is CV_8U: 60
// where the dark squares' fit lies, 200 where the light ones' does.
cv::Mat flatten_lighting(const cv::Mat& image, const std::vector<Eigen::Vector2d>& corners, int columns, int rows);

}  // namespace crumple
