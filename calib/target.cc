#include "calib/target.h"

#include <cmath>
#include <utility>

#include <fmt/format.h>

#include "calib/dictionary.h"

namespace crumple {
namespace {

// Less white than this around a marker, in modules, and it is not found.
constexpr double kLeastQuietModules = 0.5;
// Dots that come closer than this share of the pitch merge in the image.
constexpr double kLargestDot = 0.7;
constexpr int kMostAlong = 200;

int marker_count(const Target& target) {
  if (target.kind == TargetKind::apriltag) return target.columns * target.rows;
  return target.kind == TargetKind::charuco ? (target.columns + 1) * (target.rows + 1) / 2 : 0;
}

// The dots' distance in a staggered grid is half the pitch times the square root of two.
double nearest_dots_mm(const Target& target) {
  return target.staggered ? target.pitch_mm * M_SQRT1_2 : target.pitch_mm;
}

Expected<void> check_markers(const Target& target) {
  if (!dictionary_number(target.dictionary)) {
    return fail(
        fmt::format("`{}` is no dictionary of markers: it is one of OpenCV's, such as 5X5_100 or APRILTAG_36h11",
                    target.dictionary));
  }
  const DictionarySize size = size_of_dictionary(target.dictionary);
  const int last = target.first_id + marker_count(target) - 1;
  if (target.first_id < 0 || last >= size.markers) {
    return fail(
        fmt::format("the board's {} markers are numbered {} to {}, but the dictionary {} has 0 to {}: choose a "
                    "larger one or a smaller board",
                    marker_count(target), target.first_id, last, target.dictionary, size.markers - 1));
  }
  const double quiet_mm =
      target.kind == TargetKind::charuco ? 0.5 * (target.pitch_mm - target.mark_mm) : target.pitch_mm - target.mark_mm;
  const double least_mm = kLeastQuietModules * target.mark_mm / size.modules;
  if (!(target.mark_mm > 0) || quiet_mm < least_mm) {
    return fail(
        fmt::format("markers of {:g} mm leave {:.2f} mm of white beside them at a pitch of {:g} mm: {:.2f} mm are "
                    "needed",
                    target.mark_mm, quiet_mm, target.pitch_mm, least_mm));
  }
  return {};
}

std::vector<Eigen::Vector2d> staggered_points(const Target& target) {
  std::vector<Eigen::Vector2d> points;
  const double half = 0.5 * target.pitch_mm;
  for (int row = 0; row < target.rows; ++row) {
    for (int column = 0; column < target.columns; ++column) {
      points.emplace_back((2 * column + row % 2) * half, row * half);
    }
  }
  return points;
}

}  // namespace

Expected<Target> checked(const Target& target) {
  const int least = target.kind == TargetKind::apriltag ? 1 : 2;
  if (target.columns < least || target.rows < least || target.columns > kMostAlong || target.rows > kMostAlong) {
    return fail(fmt::format("a {} of {} x {} cannot be made: {} to {} each way", name_of(target.kind), target.columns,
                            target.rows, least, kMostAlong));
  }
  if (!std::isfinite(target.pitch_mm) || target.pitch_mm <= 0 || target.pitch_mm > 1000) {
    return fail(fmt::format("a pitch of {:g} mm cannot be made: above 0 and up to 1000", target.pitch_mm));
  }
  if (is_coded(target.kind)) {
    if (const auto sound = check_markers(target); !sound) return tl::unexpected(sound.error());
  }
  if (target.kind == TargetKind::dots) {
    const double largest_mm = kLargestDot * nearest_dots_mm(target);
    if (!(target.mark_mm > 0) || target.mark_mm > largest_mm) {
      return fail(fmt::format("dots of {:g} mm at a pitch of {:g} mm: they may be up to {:.2f} mm", target.mark_mm,
                              target.pitch_mm, largest_mm));
    }
    if (target.columns == target.rows && !target.staggered) {
      return fail("a square grid of dots looks the same from four sides: use one that is not square");
    }
  }
  return target;
}

Board board_of(const Target& target, const std::string& name) {
  Board board;
  switch (target.kind) {
    case TargetKind::chessboard:
    case TargetKind::charuco:
      board = Board::grid(target.columns, target.rows, target.pitch_mm);
      break;
    case TargetKind::apriltag: {
      std::vector<Eigen::Vector2d> points;
      for (const TargetMarker& marker : markers_of(target)) {
        for (const Eigen::Vector2d& corner : marker_corners_mm(marker, target.mark_mm)) points.push_back(corner);
      }
      board = Board(std::move(points));
      break;
    }
    case TargetKind::dots:
      board = target.staggered ? Board(staggered_points(target), target.mark_mm / 2)
                               : Board::grid(target.columns, target.rows, target.pitch_mm, target.mark_mm / 2);
      break;
  }
  board.name = name;
  return board;
}

bool is_coded(TargetKind kind) { return kind == TargetKind::charuco || kind == TargetKind::apriltag; }

bool share_markers(const Target& a, const Target& b) {
  if (!is_coded(a.kind) || !is_coded(b.kind) || a.dictionary != b.dictionary) return false;
  return a.first_id < b.first_id + marker_count(b) && b.first_id < a.first_id + marker_count(a);
}

bool look_alike(const Target& a, const Target& b) {
  if (is_coded(a.kind) || a.kind != b.kind || a.staggered != b.staggered) return false;
  const bool turned = !a.staggered && a.columns == b.rows && a.rows == b.columns;
  return turned || (a.columns == b.columns && a.rows == b.rows);
}

const char* name_of(TargetKind kind) {
  switch (kind) {
    case TargetKind::chessboard:
      return "chessboard";
    case TargetKind::charuco:
      return "charuco";
    case TargetKind::apriltag:
      return "apriltag";
    case TargetKind::dots:
      break;
  }
  return "dots";
}

std::string words(const Target& target) {
  const std::string grid = fmt::format("{} x {}", target.columns, target.rows);
  switch (target.kind) {
    case TargetKind::chessboard:
      return fmt::format("chessboard, {} inner corners, pitch {:g} mm", grid, target.pitch_mm);
    case TargetKind::charuco:
      return fmt::format("charuco, {} inner corners, pitch {:g} mm, markers {:g} mm, {} from {}", grid, target.pitch_mm,
                         target.mark_mm, target.dictionary, target.first_id);
    case TargetKind::apriltag:
      return fmt::format("apriltag, {} markers of {:g} mm, pitch {:g} mm, {} from {}", grid, target.mark_mm,
                         target.pitch_mm, target.dictionary, target.first_id);
    case TargetKind::dots:
      break;
  }
  return fmt::format("dots, {}{}, pitch {:g} mm, diameter {:g} mm", grid, target.staggered ? " staggered" : "",
                     target.pitch_mm, target.mark_mm);
}

std::vector<TargetMarker> markers_of(const Target& target) {
  std::vector<TargetMarker> markers;
  int id = target.first_id;
  if (target.kind == TargetKind::apriltag) {
    for (int row = 0; row < target.rows; ++row) {
      for (int column = 0; column < target.columns; ++column) {
        markers.push_back({id++, target.pitch_mm * Eigen::Vector2d(column, row)});
      }
    }
  } else if (target.kind == TargetKind::charuco) {
    const Eigen::Vector2d inset = Eigen::Vector2d::Constant(0.5 * (target.pitch_mm - target.mark_mm));
    for (int row = -1; row < target.rows; ++row) {
      for (int column = -1; column < target.columns; ++column) {
        if ((row + column) % 2 != 0) markers.push_back({id++, target.pitch_mm * Eigen::Vector2d(column, row) + inset});
      }
    }
  }
  return markers;
}

std::vector<Eigen::Vector2d> marker_corners_mm(const TargetMarker& marker, double mark_mm) {
  const Eigen::Vector2d& low = marker.low_mm;
  return {low, low + Eigen::Vector2d(mark_mm, 0), low + Eigen::Vector2d(mark_mm, mark_mm),
          low + Eigen::Vector2d(0, mark_mm)};
}

}  // namespace crumple
