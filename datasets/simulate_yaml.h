// The texts that go beside a synthetic capture's images.
#pragma once

#include <string>

#include "datasets/render/scene.h"

namespace crumple {

// capture.yaml; images are named STATION/SENSOR/FRAME.png, FRAME of three digits.
std::string capture_yaml(const Scene& scene);

// Where the board or the panel was at each station: probe_from_board or probe_from_panel as a unit quaternion
// [w, x, y, z] and a translation, to all digits; the board's true warp. With trackers, world_from_probe, and
// world_from_board or world_from_panel in their place (schema crumple-true-stations/2; version 1 states none).
std::string true_stations_yaml(const Scene& scene);

}  // namespace crumple
