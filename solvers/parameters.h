// Which parameter blocks are estimated and where each stands in the joint vector.
//
// Order: the common blocks first (per sensor its lens, then its mount; then per board its warp, then its
// scale), then the placements.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "solvers/residuals.h"

namespace crumple {

class Parameters {
 public:
  // Blocks that no view touches are held, as are those in `held`.
  Parameters(const CalibrationState& state, const std::vector<std::unique_ptr<View>>& views,
             const std::set<BlockId>& held);

  bool estimated(const BlockId& block) const { return offsets_.contains(block); }
  std::optional<int> common_offset(const BlockId& block) const;
  int common_size() const { return common_size_; }
  const std::vector<BlockId>& common_blocks() const { return common_blocks_; }
  const std::vector<std::size_t>& placements() const { return placements_; }
  std::optional<std::size_t> placement_slot(std::size_t placement) const;  // where it stands in placements()
  int size() const { return common_size_ + 6 * static_cast<int>(placements_.size()); }

  // Where the estimated ones of some blocks stand: among the tangents of all those given, side by side, and in the
  // common part or among the placements.
  struct Span {
    int column = 0;
    int size = 0;
    int common_offset = 0;
    std::optional<std::size_t> placement;  // its slot; then there is no offset
  };
  std::vector<Span> spans(const std::vector<BlockId>& blocks) const;

  // "cam0.fx", "proj0.rotation_x", "board.warp_x" (the board's name): one per row of the common part.
  std::vector<std::string> common_names(const CalibrationState& state) const;

 private:
  std::map<BlockId, int> offsets_;
  std::vector<int> lens_sizes_;
  std::vector<BlockId> common_blocks_;
  std::vector<std::size_t> placements_;
  int common_size_ = 0;
};

// The state moved by a joint tangent step, in the order of the parameters.
CalibrationState moved(const CalibrationState& state, const Parameters& parameters, const Eigen::VectorXd& step);

// "cam0.fx", "board.warp_y", "placement 3.rotation_x": one per row of the block's tangent.
std::vector<std::string> parameter_names(const BlockId& block, const CalibrationState& state);

}  // namespace crumple
