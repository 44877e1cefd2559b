#include "solvers/parameters.h"

namespace crumple {

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
    lens_sizes_.push_back(state.rig.sensors[s].lens.parameter_count());
    add_common({BlockId::Kind::lens, s});
    add_common({BlockId::Kind::mount, s});
  }
  for (std::size_t b = 0; b < state.boards.size(); ++b) {
    add_common({BlockId::Kind::warp, b});
    add_common({BlockId::Kind::scale, b});
  }
  for (std::size_t p = 0; p < state.world_from_board.size(); ++p) {
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

std::optional<std::size_t> Parameters::placement_slot(std::size_t placement) const {
  const auto found = offsets_.find({BlockId::Kind::placement, placement});
  if (found == offsets_.end()) return std::nullopt;
  return static_cast<std::size_t>(found->second - common_size_) / 6;
}

std::vector<Parameters::Span> Parameters::spans(const std::vector<BlockId>& blocks) const {
  std::vector<Span> spans;
  int column = 0;
  for (const BlockId& block : blocks) {
    const bool lens = block.kind == BlockId::Kind::lens;
    const int size = tangent_size(block.kind, lens ? lens_sizes_[block.index] : 0);
    if (const auto slot = block.kind == BlockId::Kind::placement ? placement_slot(block.index) : std::nullopt) {
      spans.push_back({column, size, 0, slot});
    } else if (const auto offset = common_offset(block)) {
      spans.push_back({column, size, *offset, std::nullopt});
    }
    column += size;
  }
  return spans;
}

std::vector<std::string> Parameters::common_names(const CalibrationState& state) const {
  std::vector<std::string> names;
  for (const BlockId& block : common_blocks_) {
    const std::vector<std::string> of_block = parameter_names(block, state);
    names.insert(names.end(), of_block.begin(), of_block.end());
  }
  return names;
}

CalibrationState moved(const CalibrationState& state, const Parameters& parameters, const Eigen::VectorXd& step) {
  CalibrationState result = state;
  int offset = 0;
  const auto move = [&](Pose& pose) { pose = retract(pose, step.segment<6>(offset)); };
  for (const BlockId& block : parameters.common_blocks()) {
    switch (block.kind) {
      case BlockId::Kind::lens: {
        Lens& lens = result.rig.sensors[block.index].lens;
        std::vector<double> values = lens.parameters();
        for (std::size_t i = 0; i < values.size(); ++i) values[i] += step[offset + static_cast<int>(i)];
        lens = lens.with_parameters(std::move(values));
        break;
      }
      case BlockId::Kind::mount:
        move(result.rig.sensors[block.index].sensor_from_mount);
        break;
      case BlockId::Kind::warp:
        result.boards[block.index].warp_mm += step.segment<2>(offset);
        break;
      case BlockId::Kind::scale:
        result.boards[block.index].scale += step[offset];
        break;
      case BlockId::Kind::placement:
        break;
    }
    offset += tangent_size(block, state);
  }
  for (const std::size_t p : parameters.placements()) {
    move(result.world_from_board[p]);
    offset += 6;
  }
  return result;
}

std::vector<std::string> parameter_names(const BlockId& block, const CalibrationState& state) {
  const bool of_board = block.kind == BlockId::Kind::warp || block.kind == BlockId::Kind::scale;
  if (of_board) {
    const std::string& board = state.boards[block.index].name;
    if (block.kind == BlockId::Kind::scale) return {board + ".scale"};
    return {board + ".warp_x", board + ".warp_y"};
  }
  std::string owner = "placement " + std::to_string(block.index);
  std::vector<std::string> names{"rotation_x",    "rotation_y",    "rotation_z",
                                 "translation_x", "translation_y", "translation_z"};
  if (block.kind != BlockId::Kind::placement) {
    const Sensor& sensor = state.rig.sensors[block.index];
    owner = sensor.name;
    if (block.kind == BlockId::Kind::lens) names = lens_parameter_names(sensor.lens.model());
  }
  for (std::string& name : names) name = owner + "." + name;
  return names;
}

}  // namespace crumple
