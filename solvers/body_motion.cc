#include "solvers/body_motion.h"

#include <algorithm>
#include <map>
#include <optional>
#include <set>
#include <utility>

#include "solvers/rig_covariance.h"
#include "solvers/small_motion.h"

namespace crumple {
namespace {

using Station = std::optional<std::size_t>;
using Motion = std::map<BlockId, Eigen::MatrixXd>;  // six rows, by the tangent of each block

struct Bodies {
  std::set<std::pair<std::size_t, Station>> boards;  // a placement, seen from a station
  std::map<Station, std::set<std::size_t>> leds;
};

Bodies bodies_before(Mount mount, const std::vector<const View*>& views, const CalibrationState& state) {
  Bodies bodies;
  for (const View* view : views) {
    const bool sees = std::any_of(view->blocks().begin(), view->blocks().end(), [&](const BlockId& block) {
      return block.kind == BlockId::Kind::mount && state.rig.sensors[block.index].mount == mount;
    });
    if (!sees) continue;
    const Station station = view->placement() && mount == Mount::world ? std::nullopt : view->station();
    if (view->placement()) bodies.boards.emplace(*view->placement(), station);
    for (const BlockId& block : view->blocks()) {
      if (block.kind == BlockId::Kind::led) bodies.leds[station].insert(block.index);
    }
  }
  return bodies;
}

void add(const BlockId& block, const Eigen::MatrixXd& part, Motion& motion) {
  auto [found, is_new] = motion.try_emplace(block, part);
  if (!is_new) found->second += part;
}

void add_board(std::size_t placement, Station station, const CalibrationState& state, double share, Motion& motion) {
  const Pose& world_from_board = state.world_from_board[placement];
  const BlockId board{BlockId::Kind::placement, placement};
  if (!station) return add(board, share * d_motion_d_pose(world_from_board), motion);
  const Pose& world_from_probe = state.world_from_probe[*station];
  const Pose probe_from_world = world_from_probe.inverse();
  const CompositionDerivative d = d_composed(probe_from_world, world_from_board);
  const Matrix6d of_pose = share * d_motion_d_pose(probe_from_world * world_from_board);
  add(board, of_pose * d.d_right, motion);
  add({BlockId::Kind::station, *station}, of_pose * d.d_left * d_inverse(world_from_probe), motion);
}

// Where a constellation stands in the frame of the mount that sees it, and how that follows from the station's pose.
struct Carrier {
  Pose mount_from_carrier;
  Matrix6d d_station = Matrix6d::Identity();
};

Carrier carrier_of(Mount mount, Station station, const CalibrationState& state) {
  if (!station) return {};
  const Pose& world_from_probe = state.world_from_probe[*station];
  if (mount == Mount::world) return {world_from_probe};
  return {world_from_probe.inverse(), d_inverse(world_from_probe)};
}

std::vector<Eigen::Vector3d> positions(const std::set<std::size_t>& leds, const Pose& frame_from_leds,
                                       const CalibrationState& state) {
  std::vector<Eigen::Vector3d> points;
  for (const std::size_t led : leds) points.push_back(frame_from_leds * state.rig.leds[led].position_mm);
  return points;
}

void add_leds(Mount mount, Station station, const std::set<std::size_t>& leds, const CalibrationState& state,
              double share, Motion& motion) {
  const Carrier carrier = carrier_of(mount, station, state);
  const Eigen::MatrixXd fit = share * d_motion_d_points(positions(leds, carrier.mount_from_carrier, state));
  Eigen::Index column = 0;
  for (const std::size_t led : leds) {
    const auto by_point = fit.middleCols<3>(column);
    column += 3;
    const Eigen::Vector3d& position = state.rig.leds[led].position_mm;
    add({BlockId::Kind::led, led}, by_point * carrier.mount_from_carrier.rotation.toRotationMatrix(), motion);
    if (!station) continue;
    const Matrix3x6d by_pose = d_transformed_d_pose(carrier.mount_from_carrier, position);
    add({BlockId::Kind::station, *station}, by_point * by_pose * carrier.d_station, motion);
  }
}

Motion mean_motion(Mount mount, const std::vector<const View*>& views, const CalibrationState& state) {
  Bodies bodies = bodies_before(mount, views, state);
  std::erase_if(bodies.leds, [&](const auto& seen) { return !span_a_frame(positions(seen.second, {}, state)); });
  Motion motion;
  for (const auto& [placement, station] : bodies.boards) {
    add_board(placement, station, state, 1 / static_cast<double>(bodies.boards.size()), motion);
  }
  if (!bodies.boards.empty()) return motion;
  for (const auto& [station, leds] : bodies.leds) {
    add_leds(mount, station, leds, state, 1 / static_cast<double>(bodies.leds.size()), motion);
  }
  return motion;
}

}  // namespace

std::vector<std::string> datum_names(Mount mount) {
  std::vector<std::string> names;
  for (const char* row : kPoseRows) {
    names.push_back(std::string(mount == Mount::probe ? "probe" : "world") + ".datum_" + row);
  }
  return names;
}

TangentFunction mean_body_motions(const std::vector<const View*>& views, const CalibrationState& state) {
  TangentFunction function;
  for (const Mount mount : {Mount::probe, Mount::world}) {
    const Motion motion = mean_motion(mount, views, state);
    if (motion.empty()) continue;
    const auto row = static_cast<Eigen::Index>(function.names.size());
    const std::vector<std::string> names = datum_names(mount);
    function.names.insert(function.names.end(), names.begin(), names.end());
    for (auto& [block, rows] : function.by_block) rows.conservativeResize(row + 6, Eigen::NoChange);
    for (auto& [block, rows] : function.by_block) rows.bottomRows<6>().setZero();
    for (const auto& [block, part] : motion) {
      auto& rows = function.by_block.try_emplace(block, Eigen::MatrixXd::Zero(row + 6, part.cols())).first->second;
      rows.bottomRows<6>() = part;
    }
  }
  return function;
}

}  // namespace crumple
