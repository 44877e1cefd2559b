// Where exactly a chessboard corner lies: the least-squares fit of a picture of two crossing edges to the pixels
// around.
//
//   I(p) = b(p) + a(p) erf(z1 / (sqrt(2) s)) erf(z2 / (sqrt(2) s)),   zi = ni . (p - corner)
//
// with the corner, the edges' directions (unit normals n1, n2) and the blur s unknown, and brightness b and contrast a
// linear in p: a light gradient, which moves detectors that look at intensities alone by some hundredths of a pixel
// towards the brighter side, is part of the model. What the model leaves out (lens distortion bends the edges, blur is
// not a Gaussian, a camera's response is not linear) is alike on both sides of the corner and does not move it: an even
// error against an odd derivative.
//
// Peers: Lucchese & Mitra (2002) fit the saddle of the blurred corner only; Mallon & Whelan (2007) fit the same model
// without the gradients.
#pragma once

#include <optional>

#include <Eigen/Core>
#include <opencv2/core/mat.hpp>

namespace crumple {

struct RefinedCorner {
  Eigen::Vector2d pixel;
  double sigma_px = 0;  // per coordinate, from the pixels' residuals: noise and what the model leaves out nearby
  double blur_px = 0;   // s
};

// `image` is single-channel, CV_8U or CV_16U; `start` within some two pixels of the corner; `step_x` and `step_y` lead
// to the neighbouring corners along the board's rows and columns. Pixels up to 0.45 of a step away count, 12 px at
// most. No value where the fit does not settle near the start or leaves most of the intensity unexplained: an occluded
// or glaring corner, or none at all.
std::optional<RefinedCorner> refine_corner(const cv::Mat& image, const Eigen::Vector2d& start,
                                           const Eigen::Vector2d& step_x, const Eigen::Vector2d& step_y);

}  // namespace crumple
