// Scenes for the renderer's tests.
#pragma once

#include <string>
#include <utility>

#include "datasets/render/scene.h"
#include "datasets/scene_file.h"

namespace crumple {

inline Scene scene_from_file(const std::string& name) {
  auto scene = read_scene(std::string(CRUMPLE_SOURCE_DIR) + "/datasets/scenes/" + name);
  if (!scene) throw std::runtime_error(scene.error().message);
  return *std::move(scene);
}

// A camera and a projector in one and the same place, without distortion, so that their pixels coincide, before a flat
// white wall at `distance_mm`. Only ambient, white and column patterns are shown.
inline Scene wall_scene(double distance_mm) {
  const ImageSize size{64, 48};
  const Lens lens = *Lens::undistorted("LENSMODEL_PINHOLE", size, 100, 100, Eigen::Vector2d(31.5, 23.5));
  Scene scene;
  scene.cameras.push_back({Sensor{"cam0", SensorKind::camera, lens, {}}, {}, {}});
  scene.projector = SceneProjector{Sensor{"proj0", SensorKind::projector, lens, {}}, {}, {}};
  PanelShape wall;
  wall.size_mm = {1000, 1000};
  scene.panel.emplace(wall, Material{0.8, 0, 0.3});
  scene.stations.push_back({"wall", false, Pose{{}, Eigen::Vector3d(0, 0, distance_mm)}});
  scene.stations.back().probe_from_surface.rotation.setIdentity();
  scene.orientations = {{0, 1, 6, 0, true}};
  scene.frames = {{FrameContent::Kind::white, 0, 0, false}};
  return scene;
}

}  // namespace crumple
