// The corners of a chessboard that a projector casts onto the board's plate, beside or over the printed one.
//
// What is seen is the print times the projection, so the print is divided out: (chessboard - black) / (white - black).
// Without a white image there is nothing to divide by, and the printed squares are painted over instead; the projected
// board must then lie beside them. The grid is found and ordered as in calib/detect_board.h: the projector lights the
// plate from the side the camera looks at, so nothing is mirrored, and the square outside corner 0 is dark.
//
// A corner is used only where the print is evenly light around it: blur mixes the two factors at the print's edges,
// which moves corners there, and on dark squares little light is left.
#pragma once

#include <vector>

#include <Eigen/Core>
#include <opencv2/core/mat.hpp>

#include "calib/target.h"
#include "recon/patterns.h"
#include "solvers/expected.h"
#include "solvers/observations.h"

namespace crumple {

// Of one camera and placement; single-channel, of one size and depth (CV_8U or CV_16U).
struct ProjectedBoardImages {
  cv::Mat chessboard;
  cv::Mat white;  // fully lit; may be empty
  cv::Mat black;  // the dark projector, for the room's light; may be empty
};

struct ProjectedCorners {
  std::vector<Eigen::Vector2d> projector_pixels;
  std::vector<Eigen::Vector2d> camera_pixels;
};

// `printed` are the marked points of `target` in the same camera and placement. The error is a reason without the
// images' name.
Expected<ProjectedCorners> detect_projected_board(const ProjectedBoardImages& images,
                                                  const ProjectedChessboard& chessboard, const Target& target,
                                                  const CornerView& printed);

}  // namespace crumple
