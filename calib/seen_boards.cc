#include "calib/seen_boards.h"

#include <algorithm>

#include "solvers/sensor_chain.h"

namespace crumple {

std::optional<std::size_t> first_board_camera(const Observations& observations, const Rig& rig) {
  const auto& corners = observations.corners;
  for (const Mount mount : {Mount::probe, Mount::world}) {
    for (std::size_t s = 0; s < rig.sensors.size(); ++s) {
      const auto sees = [&](const CornerView& view) { return view.sensor == s; };
      if (rig.sensors[s].mount == mount && std::any_of(corners.begin(), corners.end(), sees)) return s;
    }
  }
  return std::nullopt;
}

std::vector<double> board_depths_mm(const CalibrationData& data, const CalibrationState& state, std::size_t camera) {
  std::vector<double> depths_mm;
  for (const CornerView& view : data.observations.corners) {
    if (view.sensor != camera) continue;
    const Pose camera_from_board = sensor_from_board_pose(state, camera, view.placement, view.station);
    depths_mm.push_back((camera_from_board * board_centre(state.board_at(view.placement))).z());
  }
  std::sort(depths_mm.begin(), depths_mm.end());
  return depths_mm;
}

Eigen::Vector3d board_centre(const Board& board) {
  Eigen::Vector2d low = board.nominal_mm().front(), high = low;
  for (const Eigen::Vector2d& point : board.nominal_mm()) {
    low = low.cwiseMin(point);
    high = high.cwiseMax(point);
  }
  return board.on_surface(0.5 * (low + high));
}

bool in_image(const Lens& lens, const Eigen::Vector2d& pixel) {
  return pixel.minCoeff() >= 0 && pixel.x() <= lens.size().width_px - 1 && pixel.y() <= lens.size().height_px - 1;
}

}  // namespace crumple
