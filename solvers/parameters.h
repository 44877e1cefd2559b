// Which parameter blocks are estimated and where each stands in the joint vector.
//
// Order: the common blocks first (per sensor its lens, then its mount; the LEDs; per board its warp, then its scale),
// then the poses of placements and stations. Most of these are eliminated when equations are solved,
// which asks that no two of them meet in a view. Stations that meet other stations (overlaps) count among the common
// blocks. Of placements and stations that meet each other the kind with more is eliminated, and so are all that meet
// none. Eliminated ones stand last.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "solvers/prior.h"
#include "solvers/residuals.h"

namespace crumple {

class Parameters {
 public:
  // Blocks in `held` are held, and so are those that no view touches, but for those of the rig and its boards that a
  // prior tells every coordinate of: these follow what moves the rest of it. A shared lens is one block, of the sensor
  // that it is; the others' lens blocks mean it too.
  Parameters(const CalibrationState& state, const std::vector<std::unique_ptr<View>>& views,
             const std::set<BlockId>& held, const std::vector<Prior>& priors = {});

  bool estimated(const BlockId& block) const { return offsets_.contains(block); }
  std::optional<int> common_offset(const BlockId& block) const;
  int common_size() const { return common_size_; }
  const std::vector<BlockId>& common_blocks() const { return common_blocks_; }
  const std::vector<BlockId>& eliminated() const { return eliminated_; }
  std::optional<std::size_t> slot(const BlockId& block) const;  // where it stands in eliminated()
  // Of the one block among those given that is eliminated, if any is.
  std::optional<std::size_t> slot(const std::vector<BlockId>& blocks) const;
  int size() const { return common_size_ + 6 * static_cast<int>(eliminated_.size()); }

  // Where the estimated ones of some blocks stand: among the tangents of all those given, side by side, and in the
  // common part or among the eliminated poses.
  struct Span {
    int column = 0;
    int size = 0;
    int common_offset = 0;
    std::optional<std::size_t> slot;  // of an eliminated pose; then there is no offset
  };
  std::vector<Span> spans(const std::vector<BlockId>& blocks) const;

  // "cam0.fx", "proj0.rotation_x", "board.warp_x" (the board's name): one per row of the common part.
  std::vector<std::string> common_names(const CalibrationState& state) const;

 private:
  std::map<BlockId, int> offsets_;
  std::vector<int> lens_sizes_;
  std::vector<BlockId> common_blocks_;
  std::vector<BlockId> eliminated_;
  int common_size_ = 0;
};

// One block of the state moved by its tangent step; a lens takes along the sensors that share it.
void move_block(const BlockId& block, const Eigen::Ref<const Eigen::VectorXd>& step, CalibrationState& state);

// The tangent step of one block that leads from one state to another: move_block's inverse.
Eigen::VectorXd block_step(const BlockId& block, const CalibrationState& from, const CalibrationState& to);

// The state moved by a joint tangent step, in the order of the parameters.
CalibrationState moved(const CalibrationState& state, const Parameters& parameters, const Eigen::VectorXd& step);

// "cam0.fx", "board.warp_y", "placement 3.rotation_x", "led2.x": one per row of the
// block's tangent.
std::vector<std::string> parameter_names(const BlockId& block, const CalibrationState& state);

}  // namespace crumple
