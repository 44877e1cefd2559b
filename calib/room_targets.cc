#include "calib/room_targets.h"

#include <map>
#include <set>
#include <tuple>

#include <fmt/format.h>

#include "calib/target.h"
#include "solvers/closed_form/board_pose.h"

namespace crumple {
namespace {

using CornerKey = std::tuple<std::string, std::size_t, int>;  // placement, board, corner

// Roughly.
struct PlacedSight {
  const BoardSight* sight;
  Board board;
  Pose world_from_board;
};

std::vector<PlacedSight> placed(const Rig& rig, const std::vector<Pose>& world_from_probe,
                                const std::vector<BoardSpec>& boards, const std::vector<BoardSight>& sights) {
  std::vector<PlacedSight> result;
  for (const BoardSight& sight : sights) {
    const Sensor& camera = rig.sensors[sight.camera];
    const Board board = board_of(boards[sight.board].target);
    Points2d plane_mm;
    for (const int corner : sight.corners) plane_mm.emplace_back(board.point(corner).head<2>());
    const auto camera_from_board = board_pose(camera.lens, plane_mm, sight.pixels);
    if (!camera_from_board) continue;
    const Pose probe_from_board = camera.sensor_from_mount.inverse() * *camera_from_board;
    result.push_back({&sight, board, world_from_probe[sight.station] * probe_from_board});
  }
  return result;
}

std::set<CornerKey> seen_from_two_stations(const std::vector<PlacedSight>& sights) {
  std::map<CornerKey, std::set<std::size_t>> stations;
  for (const PlacedSight& placed : sights) {
    const BoardSight& sight = *placed.sight;
    for (const int corner : sight.corners) stations[{sight.placement, sight.board, corner}].insert(sight.station);
  }
  std::set<CornerKey> seen;
  for (const auto& [key, from] : stations) {
    if (from.size() > 1) seen.insert(key);
  }
  return seen;
}

}  // namespace

RoomTargets room_targets(const Rig& rig, const std::vector<Pose>& world_from_probe,
                         const std::vector<BoardSpec>& boards, const std::vector<BoardSight>& sights) {
  RoomTargets result;
  result.readings.resize(world_from_probe.size());
  const std::vector<PlacedSight> placed_sights = placed(rig, world_from_probe, boards, sights);
  const std::set<CornerKey> wanted = seen_from_two_stations(placed_sights);
  std::map<CornerKey, std::size_t> index;
  for (const auto& [seen, board, world_from_board] : placed_sights) {
    const BoardSight& sight = *seen;
    TargetReading reading{sight.camera, {}, {}};
    for (std::size_t i = 0; i < sight.corners.size(); ++i) {
      const int corner = sight.corners[i];
      const CornerKey key{sight.placement, sight.board, corner};
      if (!wanted.contains(key)) continue;
      const auto [at, is_new] = index.emplace(key, result.targets.size());
      if (is_new) {
        result.targets.push_back({fmt::format("{}/{}/{}", sight.placement, boards[sight.board].name, corner),
                                  world_from_board * board.point(corner)});
      }
      reading.targets.push_back(at->second);
      reading.pixels.push_back(sight.pixels[i]);
    }
    if (!reading.targets.empty()) result.readings[sight.station].push_back(std::move(reading));
  }
  return result;
}

}  // namespace crumple
