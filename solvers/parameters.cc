#include "solvers/parameters.h"

namespace crumple {
namespace {

std::vector<const char*> board_names(BlockId::Kind kind) {
  if (kind == BlockId::Kind::warp) return {"warp_x", "warp_y"};
  return {"scale"};
}

}  // namespace

Parameters::Parameters(const CalibrationState& state, const std::vector<std::unique_ptr<View>>& views,
                       const std::set<BlockId>& held) {
  std::set<BlockId> touched;
  for (const auto& view : views) {
    for (const BlockId& block : view->blocks()) {
      if (!held.contains(block)) touched.insert(block);
    }
  }
  const auto add_common = [&](const BlockId& block) {
    if (!touched.contains(block)) return;
    offsets_[block] = common_size_;
    common_blocks_.push_back(block);
    common_size_ += tangent_size(block, state);
  };
  for (std::size_t s = 0; s < state.rig.sensors.size(); ++s) {
    add_common({BlockId::Kind::lens, s});
    add_common({BlockId::Kind::mount, s});
  }
  for (std::size_t b = 0; b < state.boards.size(); ++b) {
    add_common({BlockId::Kind::warp, b});
    add_common({BlockId::Kind::scale, b});
  }
  for (std::size_t p = 0; p < state.probe_from_board.size(); ++p) {
    const BlockId block{BlockId::Kind::placement, p};
    if (!touched.contains(block)) continue;
    offsets_[block] = common_size_ + 6 * static_cast<int>(placements_.size());
    placements_.push_back(p);
  }
}

std::optional<int> Parameters::common_offset(const BlockId& block) const {
  const auto found = offsets_.find(block);
  if (found == offsets_.end() || block.kind == BlockId::Kind::placement) return std::nullopt;
  return found->second;
}

std::vector<std::string> Parameters::common_names(const CalibrationState& state) const {
  static const char* const pose_names[] = {"rotation_x",    "rotation_y",    "rotation_z",
                                           "translation_x", "translation_y", "translation_z"};
  std::vector<std::string> names;
  for (const BlockId& block : common_blocks_) {
    if (block.kind == BlockId::Kind::warp || block.kind == BlockId::Kind::scale) {
      for (const char* name : board_names(block.kind)) names.push_back(state.boards[block.index].name + "." + name);
      continue;
    }
    const Sensor& sensor = state.rig.sensors[block.index];
    if (block.kind == BlockId::Kind::lens) {
      for (const std::string& name : lens_parameter_names(sensor.lens.model()))
        names.push_back(sensor.name + "." + name);
    } else {
      for (const char* name : pose_names) names.push_back(sensor.name + "." + name);
    }
  }
  return names;
}

}  // namespace crumple
