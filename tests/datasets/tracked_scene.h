// A small tracked scene for tests: small.yaml's sensors and board, two trackers behind the probe, four LEDs.
#pragma once

#include <string>

#include "datasets/scene_file.h"
#include "tests/datasets/render_scenes.h"
#include "tests/temporary_folder.h"

namespace crumple {

inline const char* kTrackedKeys = R"(
leds:
  a: {position_mm: [-40, -60, -50], word: "01101010", brightness: 15}
  b: {position_mm: [60, -50, -40], word: "11001001", brightness: 15, nominal_mm: [60, -50, -41]}
  c: {position_mm: [0, 50, -90], word: "10110001", brightness: 15}
  floor: {position_mm: [-150, 200, 1300], mount: world, word: "01010111", brightness: 15}
tracker_frames: [ambient, {leds: 8}]
led_exposure: 0.05
placements:
  bench: {board: {position_mm: [0, 0, 1500], rotation_deg: [10, 5, 0]}}
  door: {panel: {position_mm: [0, 0, 1500]}}
stations:
  - {id: one, placement: bench, probe: {position_mm: [0, 40, 1000], rotation_deg: [10, 0, 0]}}
  - {id: two, placement: bench, probe: {position_mm: [60, 10, 1010], rotation_deg: [0, -12, 20]}}
  - {id: wand, scan: false, probe: {position_mm: [-50, 0, 900], rotation_deg: [0, 20, 0]}}
  - {id: door, placement: door, trackers: false, probe: {position_mm: [0, 0, 1000]}}
)";

inline const char* kTrackerSensors = R"(  tracker0:
    kind: camera
    mount: world
    size_px: [320, 240]
    lens: {focal_px: [330.4, 331.1], centre_px: [161.2, 118.8], distortion: [-0.08, 0.04, 0.0004, 0, 0]}
    blur_px: 0.9
    exposure: 12
    read_noise_electrons: 8
  tracker1:
    kind: camera
    mount: world
    size_px: [320, 240]
    lens: {focal_px: [328.9, 329.5], centre_px: [158.4, 121.3], distortion: [-0.07, 0.03, 0, 0.0003, 0]}
    position_mm: [500, 0, 100]
    rotation_deg: [0, -24, 0]
    blur_px: 0.8
    exposure: 12
    read_noise_electrons: 8
)";

inline std::string tracked_scene_text() {
  std::string text = content_of(std::string(CRUMPLE_SOURCE_DIR) + "/datasets/scenes/small.yaml");
  text = text.substr(0, text.find("stations:")) + (kTrackedKeys + 1);
  text.insert(text.find("\nlighting:"), std::string("\n") + kTrackerSensors);
  text.replace(text.find("crumple-scene/1"), 15, "crumple-scene/2");
  return text;
}

inline Scene tracked_scene() {
  auto scene = parse_scene(tracked_scene_text(), "tracked.yaml");
  if (!scene) throw std::runtime_error(scene.error().message);
  return *std::move(scene);
}

}  // namespace crumple
