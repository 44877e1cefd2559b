// A synthetic capture on disk: what a real one holds, and the truth beside it.
//
//   capture.yaml                        the description (docs/formats.md)
//   STATION/SENSOR/FRAME.png            the images, 8 or 16 bit
//   truth/scene.yaml                    the scene as it was given: surfaces, noise, seed
//   truth/rig/                          the sensors, as a rig (rig_file.h)
//   truth/stations.yaml                 probe_from_board or probe_from_panel of every station; with trackers
//                                       world_from_probe, and world_from_board or world_from_panel
//   truth/STATION/SENSOR_depth.tiff     depth along the camera's z axis in mm, 32-bit float, NaN where nothing is met
#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <string>

#include "datasets/render/scene.h"
#include "solvers/expected.h"

namespace crumple {

// The images that a scene makes, those included that chance leaves out.
std::size_t image_count(const Scene& scene);

struct SimulateOptions {
  int threads = 1;
  bool overwrite = false;
  bool depth_maps = true;
  // Called now and then, from any thread but never from two at once.
  std::function<void(std::size_t images_done, std::size_t images_in_all)> progress;
};

// Renders every station into `folder`, which appears complete or not at all. `scene_text` goes into truth/scene.yaml.
// Returns the folder. Fails where it exists already or cannot be written.
Expected<std::filesystem::path> simulate(const Scene& scene, const std::string& scene_text,
                                         const std::filesystem::path& folder, const SimulateOptions& options);

// The same into an existing folder, for callers that add files of their own before it becomes visible.
Expected<void> write_simulated_capture(const Scene& scene, const std::string& scene_text,
                                       const std::filesystem::path& folder, const SimulateOptions& options);

}  // namespace crumple
