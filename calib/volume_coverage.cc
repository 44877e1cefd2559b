#include "calib/volume_coverage.h"

#include <algorithm>
#include <utility>

#include "calib/image_parts.h"
#include "calib/seen_boards.h"
#include "solvers/sensor_chain.h"

namespace crumple {
namespace {

constexpr double kShallow = 1.25;  // far over near
constexpr int kLayers = 3;

}  // namespace

int VolumeCoverage::covered() const {
  return static_cast<int>(std::count_if(corners.begin(), corners.end(), [](std::size_t n) { return n > 0; }));
}

bool VolumeCoverage::shallow() const { return far_mm < kShallow * near_mm; }

std::optional<VolumeCoverage> volume_coverage(const Observations& observations, const CalibrationState& state,
                                              const std::vector<ViewSummary>& views) {
  const auto camera = first_board_camera(observations, state.rig);
  if (!camera) return std::nullopt;
  const Sensor& sensor = state.rig.sensors[*camera];
  std::vector<std::pair<std::size_t, double>> seen;  // part of the image, depth
  for (std::size_t v = 0; v < observations.corners.size(); ++v) {
    const CornerView& view = observations.corners[v];
    if (view.sensor != *camera) continue;
    const Pose camera_from_board = sensor_from_board_pose(state, view.sensor, view.placement, view.station);
    const Board& board = state.board_at(view.placement);
    const std::vector<char>& accepted = views[v].inlier;
    for (std::size_t i = 0; i < view.corners.size(); ++i) {
      if (!accepted[i]) continue;
      seen.emplace_back(image_part(view.pixels[i], sensor.lens.size()),
                        (camera_from_board * board.point(view.corners[i])).z());
    }
  }
  if (seen.empty()) return std::nullopt;
  const auto nearer = [](const auto& a, const auto& b) { return a.second < b.second; };
  const auto [nearest, farthest] = std::minmax_element(seen.begin(), seen.end(), nearer);
  VolumeCoverage coverage{*camera, nearest->second, farthest->second, {}};
  const double depth_mm = std::max(coverage.far_mm - coverage.near_mm, 1e-9);
  for (const auto& [part, at_mm] : seen) {
    const int layer = std::min(kLayers - 1, static_cast<int>(kLayers * (at_mm - coverage.near_mm) / depth_mm));
    ++coverage.corners[static_cast<std::size_t>(layer) * kImagePartNames.size() + part];
  }
  return coverage;
}

}  // namespace crumple
