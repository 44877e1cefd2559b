// A target as a camera sees it, drawn from its shapes: lens, tilt, blur and noise, with the truth known.
#pragma once

#include <opencv2/core/mat.hpp>

#include "calib/target.h"
#include "solvers/lens.h"
#include "solvers/pose.h"

namespace crumple {

struct DrawOptions {
  double blur_px = 0.7;
  double noise = 2;  // of 255
  unsigned seed = 1;
};

// White, with nothing on it.
cv::Mat1f blank(ImageSize size);

// Draws a target onto a scene; what it covers is replaced, a margin of a third of the pitch included.
void draw_target(const Target& target, const Lens& lens, const Pose& camera_from_board, cv::Mat1f& scene);

// 8 bit, blurred and noisy.
cv::Mat photographed(const cv::Mat1f& scene, const DrawOptions& options);

// A camera of 960 x 720 px with some distortion, and a board's pose with its middle before it.
Lens drawing_lens();
Pose drawing_pose(const Target& target, double distance_mm, const Eigen::Vector3d& rotation_rad);

// Where the marked points should be found: corners projected, of discs the centre of gravity of the image, integrated
// over the disc in polar coordinates.
Eigen::Vector2d true_pixel(const Board& board, int index, const Lens& lens, const Pose& camera_from_board);

}  // namespace crumple
