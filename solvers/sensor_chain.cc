#include "solvers/sensor_chain.h"

namespace crumple {

Pose sensor_from_board_pose(const CalibrationState& state, std::size_t sensor, std::size_t placement,
                            std::optional<std::size_t> station) {
  const Pose& sensor_from_mount = state.rig.sensors[sensor].sensor_from_mount;
  const Pose& world_from_board = state.world_from_board[placement];
  if (!station) return sensor_from_mount * world_from_board;
  return sensor_from_mount * (state.world_from_probe[*station].inverse() * world_from_board);
}

SensorChain sensor_from_board(const CalibrationState& state, std::size_t sensor, std::size_t placement,
                              std::optional<std::size_t> station) {
  const Pose& sensor_from_mount = state.rig.sensors[sensor].sensor_from_mount;
  const Pose& world_from_board = state.world_from_board[placement];
  SensorChain chain;
  if (!station) {
    const CompositionDerivative d = d_composed(sensor_from_mount, world_from_board);
    chain.pose = sensor_from_mount * world_from_board;
    chain.d_mount = d.d_left;
    chain.d_board = d.d_right;
    return chain;
  }
  const Pose& world_from_probe = state.world_from_probe[*station];
  const Pose probe_from_world = world_from_probe.inverse();
  const Pose probe_from_board = probe_from_world * world_from_board;
  const CompositionDerivative in_probe = d_composed(probe_from_world, world_from_board);
  const CompositionDerivative in_sensor = d_composed(sensor_from_mount, probe_from_board);
  chain.pose = sensor_from_mount * probe_from_board;
  chain.d_mount = in_sensor.d_left;
  chain.d_station = in_sensor.d_right * in_probe.d_left * d_inverse(world_from_probe);
  chain.d_board = in_sensor.d_right * in_probe.d_right;
  return chain;
}

SensorChain sensor_from_leds(const CalibrationState& state, std::size_t sensor, std::optional<std::size_t> station) {
  const Pose& sensor_from_mount = state.rig.sensors[sensor].sensor_from_mount;
  SensorChain chain;
  chain.pose = sensor_from_mount;
  chain.d_mount.setIdentity();
  if (!station) return chain;
  const Pose& world_from_probe = state.world_from_probe[*station];
  if (state.rig.sensors[sensor].mount == Mount::probe) {
    const Pose probe_from_world = world_from_probe.inverse();
    const CompositionDerivative d = d_composed(sensor_from_mount, probe_from_world);
    chain.pose = sensor_from_mount * probe_from_world;
    chain.d_mount = d.d_left;
    chain.d_station = d.d_right * d_inverse(world_from_probe);
    return chain;
  }
  const CompositionDerivative d = d_composed(sensor_from_mount, world_from_probe);
  chain.pose = sensor_from_mount * world_from_probe;
  chain.d_mount = d.d_left;
  chain.d_station = d.d_right;
  return chain;
}

}  // namespace crumple
