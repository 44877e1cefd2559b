#include "tests/benchmark/rendered_coverage.h"

#include <algorithm>
#include <utility>

#include "datasets/scene_file.h"
#include "tests/benchmark/simulated_calibrations.h"

namespace crumple {
namespace {

Scene boards_twice(Scene scene) {
  std::erase_if(scene.stations, [](const SceneStation& station) { return !station.board; });
  const std::vector<SceneStation> once = scene.stations;
  for (SceneStation again : once) {
    again.id += "_again";
    scene.stations.push_back(std::move(again));
  }
  return scene;
}

CalibrationState true_state(const Scene& scene) {
  CalibrationState state{true_rig(scene), {scene.board->board()}, {}, {}};
  for (const SceneStation& station : scene.stations) {
    state.world_from_board.push_back(world_from_surface(station));
    state.board_of.push_back(0);
  }
  return state;
}

}  // namespace

Expected<CoverageConfiguration> rendered_configuration() {
  auto read = read_scene(CRUMPLE_SOURCE_DIR "/datasets/scenes/small.yaml");
  if (!read) return tl::unexpected(read.error());
  const auto scene = std::make_shared<const Scene>(boards_twice(*std::move(read)));
  const auto draw = [scene](std::mt19937_64& random) -> Expected<CoverageCampaign> {
    const Scene redrawn_scene = redrawn(*scene, random());
    auto simulated = simulate_calibration(redrawn_scene, 1);
    if (!simulated) return tl::unexpected(simulated.error());
    CoverageCampaign campaign;
    campaign.truth = true_state(redrawn_scene);
    campaign.measured = std::move(simulated->data);
    return campaign;
  };
  return CoverageConfiguration{.name = "camera and projector, rendered images", .draw = draw, .rendered = true};
}

}  // namespace crumple
