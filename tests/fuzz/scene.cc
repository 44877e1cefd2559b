// A scene's description. One that is accepted gives a capture.yaml that is accepted too.
#include "datasets/capture.h"
#include "datasets/scene_file.h"
#include "datasets/simulate_yaml.h"
#include "tests/fuzz/input.h"

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace crumple;
  const auto scene = parse_scene(text_of(data, size), "scene.yaml");
  if (!scene) return 0;
  for (const SceneStation& station : scene->stations) {
    const Pose& pose = station.probe_from_surface;
    require(pose.rotation.coeffs().allFinite() && pose.translation.allFinite(), "placements are finite");
  }
  const std::string description = capture_yaml(*scene);
  const auto capture = parse_capture(description, "capture.yaml");
  require(capture.has_value(), (capture ? "" : capture.error().message) + "\n" + description);
  return 0;
}
