// Which parameter blocks are estimated and where each stands in the joint vector.
//
// Order: the common blocks first (per sensor its lens, then its mount; then the board's warp), then the placements.
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

  // Where the estimated blocks of a view stand: in ViewEvaluation::local_from_blocks, and in the common part (no offset
  // for its placement).
  struct Span {
    int column;
    int size;
    std::optional<int> common_offset;
  };
  std::vector<Span> spans(const View& view) const;

  // "cam0.fx", "proj0.rotation_x", "board.warp_x": one per row of the common part.
  std::vector<std::string> common_names(const CalibrationState& state) const;

 private:
  std::map<BlockId, int> offsets_;
  std::map<BlockId, int> sizes_;  // of held ones too
  std::vector<BlockId> common_blocks_;
  std::vector<std::size_t> placements_;
  int common_size_ = 0;
};

// The state moved by a joint tangent step, in the order of the parameters.
CalibrationState moved(const CalibrationState& state, const Parameters& parameters, const Eigen::VectorXd& step);

}  // namespace crumple
