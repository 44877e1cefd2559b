// What is printed on a calibration board, and the marked points it carries.
//
//   chessboard  `columns` x `rows` inner corners, the square outside the first one dark.
//               Index = row * columns + column.
//   charuco     the same, with a coded marker in every light square; markers are numbered from `first_id`, row by row
//               from the top left. A part of the board is enough.
//   apriltag    `columns` x `rows` coded markers, numbered alike; dark squares fill the corners of the gaps between
//               them, so that the corners of a marker are crossing edges, as on a chessboard. A marker's points
//               are its corners: index = 4 * marker + (0 top left, 1 top right, 2 bottom right, 3 bottom left); the
//               board's origin is the first.
//   dots        `columns` x `rows` dark discs. Index = row * columns + column. Staggered: every second row is shifted
//               by half a pitch, and the rows are half a pitch apart (OpenCV's asymmetric grid).
#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>

#include "solvers/board.h"
#include "solvers/expected.h"

namespace crumple {

enum class TargetKind { chessboard, charuco, apriltag, dots };

struct Target {
  int columns = 0;
  int rows = 0;
  double pitch_mm = 0;  // of neighbouring corners, markers or dots
  TargetKind kind = TargetKind::chessboard;
  double mark_mm = 0;           // charuco and apriltag: side of a marker; dots: diameter
  std::string dictionary = {};  // charuco and apriltag: OpenCV's name, such as "4X4_50" or "APRILTAG_36h11"
  int first_id = 0;             // charuco and apriltag
  bool staggered = false;       // dots
};

// The target where it can be made and told from others; else a sentence that says why not.
Expected<Target> checked(const Target& target);

Board board_of(const Target& target, const std::string& name = "board");

bool is_coded(TargetKind kind);

// Whether a marker of one could be taken for the other's.
bool share_markers(const Target& a, const Target& b);

// Whether one without markers could be taken for the other: of one kind, with as many points each way.
bool look_alike(const Target& a, const Target& b);

// "chessboard" and so on, and in words: "chessboard, 9 x 6 inner corners, pitch 25 mm".
const char* name_of(TargetKind kind);
std::string words(const Target& target);

// One coded marker: the corner of the marker's square that comes first, mm, and which of its dictionary it is.
struct TargetMarker {
  int id = 0;
  Eigen::Vector2d low_mm;
};
// In the order of their numbers. Empty where the target is not coded.
std::vector<TargetMarker> markers_of(const Target& target);

// The corners of a marker, index as above.
std::vector<Eigen::Vector2d> marker_corners_mm(const TargetMarker& marker, double mark_mm);

}  // namespace crumple
