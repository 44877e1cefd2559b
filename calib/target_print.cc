#include "calib/target_print.h"

#include <cmath>

#include "calib/dictionary.h"

namespace crumple {

TargetPrint::TargetPrint(const Target& target)
    : cell_mm_(is_coded(target.kind) ? target.mark_mm / 8 : target.pitch_mm) {
  if (target.kind == TargetKind::chessboard || target.kind == TargetKind::charuco) add_squares(target);
  if (is_coded(target.kind)) add_markers(target);
  if (target.kind == TargetKind::apriltag) add_corner_squares(target);
  if (target.kind == TargetKind::dots) {
    const Board board = board_of(target);
    for (const Eigen::Vector2d& centre : board.nominal_mm()) discs_.push_back({centre, board.disc_radius_mm()});
  }
  index_shapes();
}

void TargetPrint::add_squares(const Target& target) {
  for (int row = -1; row < target.rows; ++row) {
    for (int column = -1; column < target.columns; ++column) {
      if ((row + column) % 2 != 0) continue;
      const Eigen::Vector2d low = target.pitch_mm * Eigen::Vector2d(column, row);
      boxes_.push_back({low, low + Eigen::Vector2d::Constant(target.pitch_mm)});
    }
  }
}

// Dark modules, those side by side in a row as one box.
void TargetPrint::add_markers(const Target& target) {
  for (const TargetMarker& marker : markers_of(target)) {
    const cv::Mat modules = marker_modules(target.dictionary, marker.id);
    const double side = target.mark_mm / modules.cols;
    for (int row = 0; row < modules.rows; ++row) {
      for (int first = 0; first < modules.cols; ++first) {
        if (modules.at<std::uint8_t>(row, first) != 0) continue;
        int end = first + 1;
        while (end < modules.cols && modules.at<std::uint8_t>(row, end) == 0) ++end;
        boxes_.push_back(
            {marker.low_mm + side * Eigen::Vector2d(first, row), marker.low_mm + side * Eigen::Vector2d(end, row + 1)});
        first = end;
      }
    }
  }
}

void TargetPrint::add_corner_squares(const Target& target) {
  const double gap = target.pitch_mm - target.mark_mm;
  for (int row = 0; row <= target.rows; ++row) {
    for (int column = 0; column <= target.columns; ++column) {
      const Eigen::Vector2d high = target.pitch_mm * Eigen::Vector2d(column, row);
      boxes_.push_back({high - Eigen::Vector2d::Constant(gap), high});
    }
  }
}

void TargetPrint::index_shapes() {
  for (const PrintedDisc& disc : discs_) {
    const Eigen::Vector2d radius = Eigen::Vector2d::Constant(disc.radius_mm);
    if (&disc == &discs_.front()) extent_ = {disc.centre_mm - radius, disc.centre_mm + radius};
    extent_.low_mm = extent_.low_mm.cwiseMin(disc.centre_mm - radius);
    extent_.high_mm = extent_.high_mm.cwiseMax(disc.centre_mm + radius);
  }
  for (const PrintedBox& box : boxes_) {
    if (&box == &boxes_.front()) extent_ = box;
    extent_.low_mm = extent_.low_mm.cwiseMin(box.low_mm);
    extent_.high_mm = extent_.high_mm.cwiseMax(box.high_mm);
  }
  cell_count_ = cell_of(extent_.high_mm) + Eigen::Vector2i::Ones();
  cells_.resize(static_cast<std::size_t>(cell_count_.x()) * static_cast<std::size_t>(cell_count_.y()));
  const auto touch = [&](const Eigen::Vector2d& low, const Eigen::Vector2d& high, std::size_t shape,
                         std::vector<std::size_t> Cell::*shapes) {
    const Eigen::Vector2i first = cell_of(low), last = cell_of(high);
    for (int y = first.y(); y <= last.y(); ++y) {
      for (int x = first.x(); x <= last.x(); ++x) {
        (cells_[static_cast<std::size_t>(y * cell_count_.x() + x)].*shapes).push_back(shape);
      }
    }
  };
  for (std::size_t i = 0; i < boxes_.size(); ++i) touch(boxes_[i].low_mm, boxes_[i].high_mm, i, &Cell::boxes);
  for (std::size_t i = 0; i < discs_.size(); ++i) {
    const Eigen::Vector2d radius = Eigen::Vector2d::Constant(discs_[i].radius_mm);
    touch(discs_[i].centre_mm - radius, discs_[i].centre_mm + radius, i, &Cell::discs);
  }
}

Eigen::Vector2i TargetPrint::cell_of(const Eigen::Vector2d& at_mm) const {
  const Eigen::Vector2d cell = ((at_mm - extent_.low_mm) / cell_mm_).array().floor();
  return cell.cast<int>();
}

bool TargetPrint::dark(const Eigen::Vector2d& at_mm) const {
  const bool outside =
      (at_mm.array() < extent_.low_mm.array()).any() || (at_mm.array() > extent_.high_mm.array()).any();
  if (outside) return false;
  const Eigen::Vector2i at = cell_of(at_mm);
  const Cell& cell = cells_[static_cast<std::size_t>(at.y() * cell_count_.x() + at.x())];
  for (const std::size_t i : cell.boxes) {
    const PrintedBox& box = boxes_[i];
    if ((at_mm.array() >= box.low_mm.array()).all() && (at_mm.array() < box.high_mm.array()).all()) return true;
  }
  for (const std::size_t i : cell.discs) {
    if ((at_mm - discs_[i].centre_mm).norm() < discs_[i].radius_mm) return true;
  }
  return false;
}

}  // namespace crumple
