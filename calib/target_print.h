// The dark shapes of a target, in its board's frame: for drawing it and for rendering it.
#pragma once

#include <cstddef>
#include <vector>

#include <Eigen/Core>

#include "calib/target.h"

namespace crumple {

struct PrintedBox {
  Eigen::Vector2d low_mm;
  Eigen::Vector2d high_mm;
};

struct PrintedDisc {
  Eigen::Vector2d centre_mm;
  double radius_mm = 0;
};

class TargetPrint {
 public:
  // Precondition: the target is a checked one.
  explicit TargetPrint(const Target& target);

  const std::vector<PrintedBox>& boxes() const { return boxes_; }
  const std::vector<PrintedDisc>& discs() const { return discs_; }
  // The smallest box around everything dark.
  const PrintedBox& extent() const { return extent_; }

  bool dark(const Eigen::Vector2d& at_mm) const;

 private:
  struct Cell {
    std::vector<std::size_t> boxes, discs;
  };
  void add_squares(const Target& target);
  void add_markers(const Target& target);
  void add_corner_squares(const Target& target);
  void index_shapes();
  Eigen::Vector2i cell_of(const Eigen::Vector2d& at_mm) const;

  std::vector<PrintedBox> boxes_;
  std::vector<PrintedDisc> discs_;
  PrintedBox extent_;
  double cell_mm_ = 1;
  Eigen::Vector2i cell_count_ = Eigen::Vector2i::Ones();
  std::vector<Cell> cells_;  // which shapes touch which cell of a grid
};

}  // namespace crumple
