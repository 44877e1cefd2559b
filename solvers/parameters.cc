#include "solvers/parameters.h"

#include <algorithm>

#include "solvers/rig_covariance.h"

namespace crumple {
namespace {

// The block itself or, of a shared lens, that of the sensor which it is of.
BlockId owner_of(const BlockId& block, const CalibrationState& state) {
  if (block.kind != BlockId::Kind::lens) return block;
  return {block.kind, state.rig.sensors[block.index].lens_of.value_or(block.index)};
}

// Those of some poses that share a view with another of them.
std::set<BlockId> meeting(const std::vector<std::unique_ptr<View>>& views, const std::set<BlockId>& poses) {
  std::set<BlockId> met;
  for (const auto& view : views) {
    std::vector<BlockId> here;
    for (const BlockId& block : view->blocks()) {
      if (poses.contains(block)) here.push_back(block);
    }
    if (here.size() > 1) met.insert(here.begin(), here.end());
  }
  return met;
}

// Stations that meet other stations in a view.
std::set<BlockId> tied_stations(const std::vector<std::unique_ptr<View>>& views, const std::set<BlockId>& estimated) {
  std::set<BlockId> tied;
  for (const auto& view : views) {
    std::vector<BlockId> stations;
    for (const BlockId& block : view->blocks()) {
      if (block.kind == BlockId::Kind::station && estimated.contains(block)) stations.push_back(block);
    }
    if (stations.size() > 1) tied.insert(stations.begin(), stations.end());
  }
  return tied;
}

bool tells_wholly(const Prior& prior, const BlockId& block, const CalibrationState& state) {
  const auto told = std::count_if(prior.terms().begin(), prior.terms().end(),
                                  [&](const PriorTerm& term) { return term.block == block; });
  return told == tangent_size(block, state);
}

}  // namespace

Parameters::Parameters(const CalibrationState& state, const std::vector<std::unique_ptr<View>>& views,
                       const std::set<BlockId>& held, const std::vector<Prior>& priors) {
  std::set<BlockId> touched;
  for (const auto& view : views) {
    for (const BlockId& block : view->blocks()) {
      const BlockId owner = owner_of(block, state);
      if (!held.contains(owner)) touched.insert(owner);
    }
  }
  for (const Prior& prior : priors) {
    for (const BlockId& block : prior.blocks()) {
      const bool of_a_pose = block.kind == BlockId::Kind::placement || block.kind == BlockId::Kind::station;
      if (!of_a_pose && !held.contains(block) && tells_wholly(prior, block, state)) touched.insert(block);
    }
  }
  const auto add_common = [&](const BlockId& block) {
    if (!touched.contains(block)) return;
    offsets_[block] = common_size_;
    common_blocks_.push_back(block);
    common_size_ += tangent_size(block, state);
  };
  for (std::size_t s = 0; s < state.rig.sensors.size(); ++s) {
    const BlockId lens{BlockId::Kind::lens, s}, owner = owner_of(lens, state);
    lens_sizes_.push_back(state.rig.sensors[s].lens.parameter_count());
    if (owner == lens) add_common(lens);
    if (owner != lens && offsets_.contains(owner)) offsets_[lens] = offsets_.at(owner);
    add_common({BlockId::Kind::mount, s});
  }
  for (std::size_t l = 0; l < state.rig.leds.size(); ++l) add_common({BlockId::Kind::led, l});
  for (std::size_t b = 0; b < state.boards.size(); ++b) {
    add_common({BlockId::Kind::warp, b});
    add_common({BlockId::Kind::scale, b});
  }
  const std::set<BlockId> tied = tied_stations(views, touched);
  std::set<BlockId> untied;
  for (const BlockId& block : touched) {
    if (!block.is_pose()) continue;
    if (tied.contains(block)) {
      add_common(block);
    } else {
      untied.insert(block);
    }
  }
  const std::set<BlockId> met = meeting(views, untied);
  const auto placements = std::count_if(met.begin(), met.end(),
                                        [](const BlockId& block) { return block.kind == BlockId::Kind::placement; });
  const bool fewer_placements = 2 * placements < static_cast<std::ptrdiff_t>(met.size());
  const auto fewer = fewer_placements ? BlockId::Kind::placement : BlockId::Kind::station;
  for (const BlockId& block : untied) {
    if (block.kind == fewer && met.contains(block)) {
      add_common(block);
    } else {
      eliminated_.push_back(block);
    }
  }
  for (std::size_t i = 0; i < eliminated_.size(); ++i) {
    offsets_[eliminated_[i]] = common_size_ + 6 * static_cast<int>(i);
  }
}

std::optional<int> Parameters::common_offset(const BlockId& block) const {
  const auto found = offsets_.find(block);
  if (found == offsets_.end() || found->second >= common_size_) return std::nullopt;
  return found->second;
}

std::optional<std::size_t> Parameters::slot(const BlockId& block) const {
  if (!block.is_pose()) return std::nullopt;
  const auto found = offsets_.find(block);
  if (found == offsets_.end() || found->second < common_size_) return std::nullopt;
  return static_cast<std::size_t>(found->second - common_size_) / 6;
}

std::optional<std::size_t> Parameters::slot(const std::vector<BlockId>& blocks) const {
  for (const BlockId& block : blocks) {
    if (const auto found = slot(block)) return found;
  }
  return std::nullopt;
}

std::vector<Parameters::Span> Parameters::spans(const std::vector<BlockId>& blocks) const {
  std::vector<Span> spans;
  int column = 0;
  for (const BlockId& block : blocks) {
    const bool lens = block.kind == BlockId::Kind::lens;
    const int size = tangent_size(block.kind, lens ? lens_sizes_[block.index] : 0);
    if (const auto of_eliminated = slot(block)) {
      spans.push_back({column, size, 0, of_eliminated});
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

void move_block(const BlockId& block, const Eigen::Ref<const Eigen::VectorXd>& step, CalibrationState& state) {
  switch (block.kind) {
    case BlockId::Kind::lens: {
      Lens& lens = state.rig.sensors[block.index].lens;
      std::vector<double> values = lens.parameters();
      for (std::size_t i = 0; i < values.size(); ++i) values[i] += step[static_cast<Eigen::Index>(i)];
      lens = lens.with_parameters(std::move(values));
      for (Sensor& sharer : state.rig.sensors) {
        if (sharer.lens_of == block.index) sharer.lens = lens;
      }
      return;
    }
    case BlockId::Kind::mount: {
      Pose& pose = state.rig.sensors[block.index].sensor_from_mount;
      pose = retract(pose, step);
      return;
    }
    case BlockId::Kind::warp:
      state.boards[block.index].warp_mm += step;
      return;
    case BlockId::Kind::scale:
      state.boards[block.index].scale += step[0];
      return;
    case BlockId::Kind::placement:
      state.world_from_board[block.index] = retract(state.world_from_board[block.index], step);
      return;
    case BlockId::Kind::station:
      state.world_from_probe[block.index] = retract(state.world_from_probe[block.index], step);
      return;
    case BlockId::Kind::led:
      state.rig.leds[block.index].position_mm += step;
      return;
  }
}

Eigen::VectorXd block_step(const BlockId& block, const CalibrationState& from, const CalibrationState& to) {
  switch (block.kind) {
    case BlockId::Kind::lens: {
      const auto parameters = [&](const CalibrationState& of) {
        const std::vector<double>& p = of.rig.sensors[block.index].lens.parameters();
        return Eigen::Map<const Eigen::VectorXd>(p.data(), static_cast<Eigen::Index>(p.size()));
      };
      return parameters(to) - parameters(from);
    }
    case BlockId::Kind::mount:
      return local_step(from.rig.sensors[block.index].sensor_from_mount, to.rig.sensors[block.index].sensor_from_mount);
    case BlockId::Kind::warp:
      return to.boards[block.index].warp_mm - from.boards[block.index].warp_mm;
    case BlockId::Kind::scale:
      return Eigen::VectorXd::Constant(1, to.boards[block.index].scale - from.boards[block.index].scale);
    case BlockId::Kind::placement:
      return local_step(from.world_from_board[block.index], to.world_from_board[block.index]);
    case BlockId::Kind::station:
      return local_step(from.world_from_probe[block.index], to.world_from_probe[block.index]);
    case BlockId::Kind::led:
      break;
  }
  return to.rig.leds[block.index].position_mm - from.rig.leds[block.index].position_mm;
}

CalibrationState moved(const CalibrationState& state, const Parameters& parameters, const Eigen::VectorXd& step) {
  CalibrationState result = state;
  int offset = 0;
  for (const auto* blocks : {&parameters.common_blocks(), &parameters.eliminated()}) {
    for (const BlockId& block : *blocks) {
      const int size = tangent_size(block, state);
      move_block(block, step.segment(offset, size), result);
      offset += size;
    }
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
  if (block.kind == BlockId::Kind::led) {
    const std::string& led = state.rig.leds[block.index].name;
    return {led + ".x", led + ".y", led + ".z"};
  }
  std::string owner = (block.kind == BlockId::Kind::station ? "station " : "placement ") + std::to_string(block.index);
  std::vector<std::string> names(kPoseRows.begin(), kPoseRows.end());
  if (!block.is_pose()) {
    const Sensor& sensor = state.rig.sensors[block.index];
    owner = sensor.name;
    if (block.kind == BlockId::Kind::lens) names = lens_parameter_names(sensor.lens.model());
  }
  for (std::string& name : names) name = owner + "." + name;
  return names;
}

}  // namespace crumple
