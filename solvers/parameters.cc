#include "solvers/parameters.h"

namespace crumple {

Parameters::Parameters(const CalibrationState& state, const std::vector<std::unique_ptr<View>>& views,
                       const std::set<BlockId>& held) {
  std::set<BlockId> touched;
  for (const auto& view : views) {
    for (const BlockId& block : view->blocks()) {
      sizes_.try_emplace(block, tangent_size(block, state));
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
  add_common({BlockId::Kind::warp});
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

std::optional<std::size_t> Parameters::placement_slot(std::size_t placement) const {
  const auto found = offsets_.find({BlockId::Kind::placement, placement});
  if (found == offsets_.end()) return std::nullopt;
  return static_cast<std::size_t>(found->second - common_size_) / 6;
}

std::vector<Parameters::Span> Parameters::spans(const View& view) const {
  std::vector<Span> spans;
  int column = 0;
  for (const BlockId& block : view.blocks()) {
    const int size = sizes_.at(block);
    if (estimated(block)) spans.push_back({column, size, common_offset(block)});
    column += size;
  }
  return spans;
}

std::vector<std::string> Parameters::common_names(const CalibrationState& state) const {
  static const char* const pose_names[] = {"rotation_x",    "rotation_y",    "rotation_z",
                                           "translation_x", "translation_y", "translation_z"};
  std::vector<std::string> names;
  for (const BlockId& block : common_blocks_) {
    if (block.kind == BlockId::Kind::warp) {
      names.insert(names.end(), {"board.warp_x", "board.warp_y"});
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
        move(result.rig.sensors[block.index].sensor_from_probe);
        break;
      case BlockId::Kind::warp:
        result.board.warp_mm += step.segment<2>(offset);
        break;
      case BlockId::Kind::placement:
        break;
    }
    offset += tangent_size(block, state);
  }
  for (const std::size_t p : parameters.placements()) {
    move(result.probe_from_board[p]);
    offset += 6;
  }
  return result;
}

}  // namespace crumple
