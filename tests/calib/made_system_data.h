// A made system's observations as a calibration takes them.
#pragma once

#include "calib/calibration_data.h"
#include "tests/solvers/made_system.h"

namespace crumple {

inline CalibrationData data_of(const MadeSystem& made) {
  CalibrationData data;
  for (const Sensor& sensor : made.truth.rig.sensors) {
    data.sensors.push_back(
        {sensor.name, sensor.kind, sensor.lens.size(), sensor.lens.model(), sensor.mount, sensor.lens_of});
  }
  data.boards = {{"board", {11, 8, 30}, {}}, {"tracker_board", {10, 7, 60}, {}}};
  data.board_of = made.truth.board_of;
  data.observations = made.observations;
  for (std::size_t p = 0; p < made.truth.world_from_board.size(); ++p) {
    data.placement_names.push_back("placement_" + std::to_string(p));
  }
  for (std::size_t s = 0; s < made.truth.world_from_probe.size(); ++s) {
    data.station_names.push_back("station_" + std::to_string(s));
  }
  for (const Led& led : made.truth.rig.leds) data.leds.push_back({led.name, Eigen::Vector3d::Zero(), led.mount});
  // Stripe views come in pairs, columns and rows, as a rule at the same camera pixels.
  const std::vector<StripeView>& stripes = made.observations.stripes;
  for (std::size_t v = 0; v + 1 < stripes.size(); v += 2) {
    if (stripes[v].camera_pixels != stripes[v + 1].camera_pixels) continue;
    PixelPairs pairs{stripes[v].camera, stripes[v].projector, stripes[v].placement, stripes[v].camera_pixels, {},
                     stripes[v].station};
    for (std::size_t i = 0; i < stripes[v].coordinates_px.size(); ++i) {
      pairs.projector_pixels.emplace_back(stripes[v].coordinates_px[i], stripes[v + 1].coordinates_px[i]);
    }
    data.pairs.push_back(std::move(pairs));
  }
  return data;
}

}  // namespace crumple
