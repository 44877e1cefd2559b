// The made rig's observations as a calibration takes them.
#pragma once

#include "calib/calibration_data.h"
#include "tests/solvers/synthetic.h"

namespace crumple {

inline CalibrationData data_of(const Synthetic& made) {
  CalibrationData data;
  for (const Sensor& sensor : made.truth.rig.sensors) {
    data.sensors.push_back({sensor.name, sensor.kind, sensor.lens.size(), sensor.lens.model()});
  }
  data.boards = {{"board", {9, 7, 40}, {}}};
  data.board_of = made.truth.board_of;
  data.observations = made.observations;
  for (std::size_t p = 0; p < made.observations.placement_count; ++p) {
    data.placement_names.push_back("p" + std::to_string(p));
    const FeatureView& features = made.observations.features[p];
    data.pairs.push_back({0, 1, p, features.camera_pixels, features.projector_pixels});
  }
  return data;
}

}  // namespace crumple
