// placements.yaml of a rig. What is accepted can be written and comes back the same.
#include "datasets/placements_file.h"
#include "datasets/target_yaml.h"
#include "tests/fuzz/input.h"

namespace {

bool same(const crumple::Pose& a, const crumple::Pose& b) {
  return a.rotation.coeffs() == b.rotation.coeffs() && a.translation == b.translation;
}

}  // namespace

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace crumple;
  const auto all = parse_placements(text_of(data, size), "placements.yaml");
  if (!all) {
    require(!all.error().message.empty(), "a refusal says why");
    return 0;
  }
  for (const BoardPlacement& placement : all->placements) {
    require(placement.board < all->boards.size(), "what is placed is a board");
  }
  const std::string written = placements_yaml(*all);
  const auto again = parse_placements(written, "placements.yaml");
  require(again.has_value(), (again ? "" : again.error().message) + "\n" + written);
  require(again->boards.size() == all->boards.size() && again->placements.size() == all->placements.size() &&
              again->stations.size() == all->stations.size(),
          "none is lost");
  for (std::size_t i = 0; i < all->boards.size(); ++i) {
    const PlacedBoard &before = all->boards[i], &after = again->boards[i];
    require(after.name == before.name && target_yaml(after.target) == target_yaml(before.target) &&
                after.warp_mm == before.warp_mm && after.warp_estimated == before.warp_estimated &&
                after.scale == before.scale,
            "boards come back the same");
  }
  for (std::size_t i = 0; i < all->placements.size(); ++i) {
    const BoardPlacement &before = all->placements[i], &after = again->placements[i];
    require(after.name == before.name && after.board == before.board &&
                same(after.world_from_board, before.world_from_board),
            "placements come back the same");
  }
  for (std::size_t i = 0; i < all->stations.size(); ++i) {
    const ProbeStation &before = all->stations[i], &after = again->stations[i];
    require(after.name == before.name && same(after.world_from_probe, before.world_from_probe),
            "stations come back the same");
  }
  return 0;
}
