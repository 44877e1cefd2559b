// The chessboard's inner corners in an image, sub-pixel, each with its index on the board.
//
// OpenCV's sector-based detector finds the grid; this decides which corner is which:
//   * x cross y points into the board, so a grid that comes out mirrored is turned back;
//   * a board with one even and one odd number of inner corners tells its two ends apart by colour: the square outside
//     corner 0 is dark. Where both are even or both odd the print looks the same after half a turn; then x is taken to
//     point to the right in the image, so cameras that see one board together must be upright to within 60 degrees of
//     each other;
//   * the outermost corners must have dark and light squares about them in turns, at least along half of each line: a
//     board's rim is taken for corners now and then. Where every search finds such a grid, the image is refused;
//   * a square grid (columns = rows) would have four such orders and is refused;
//   * a partial board is placed by its visible ends: along each direction in which corners are missing, exactly one end
//     must be cut off by the image's border. Anything else is ambiguous and is refused.
// Every corner's place is then the fit of calib/refine_corner.h.
#pragma once

#include <vector>

#include <opencv2/core/mat.hpp>

#include "solvers/board.h"
#include "solvers/expected.h"

namespace crumple {

struct DetectedBoard {
  std::vector<int> corners;             // Board::point indices, ascending
  std::vector<Eigen::Vector2d> pixels;  // centres of pixels are integers
  int unrefined =
      0;  // points found that are left out: no two crossing edges (calib/refine_corner.h) or no dot fit them
  bool complete(const Board& board) const { return static_cast<int>(corners.size()) == board.point_count(); }
};

// The corners of any chessboard, printed or projected. `image` is single-channel, CV_8U or CV_16U. The error is a
// reason without the image's name.
Expected<DetectedBoard> detect_grid(const cv::Mat& image, int columns, int rows);

}  // namespace crumple
