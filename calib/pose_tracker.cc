#include "calib/pose_tracker.h"

#include <cassert>
#include <numeric>

#include "tracking/probe_pose.h"

namespace crumple {
namespace {

constexpr std::size_t kLeastPoints = 4;  // three have up to four poses
constexpr double kSigmaOfRoughPoints_px = 5;

}  // namespace

Expected<Pose> pose_tracker(const Lens& lens, const std::vector<Eigen::Vector3d>& in_world_mm,
                            const std::vector<Eigen::Vector2d>& pixels) {
  assert(in_world_mm.size() == pixels.size());
  LedView view{0, std::vector<std::size_t>(pixels.size()), pixels, {}};
  std::iota(view.leds.begin(), view.leds.end(), std::size_t{0});
  return pose_trackers({{"tracker", SensorKind::camera, lens, {}, Mount::world}}, in_world_mm, {view});
}

Expected<Pose> pose_trackers(const std::vector<Sensor>& trackers, const std::vector<Eigen::Vector3d>& in_world_mm,
                             const std::vector<LedView>& seen) {
  if (in_world_mm.size() < kLeastPoints) return fail("it sees fewer than four points whose places are known");
  // As if the world were a probe that these cameras watch.
  Rig rig{trackers, {}, {}, {}};
  for (const Eigen::Vector3d& point : in_world_mm) rig.leds.push_back({"", point, Mount::probe});
  const Eigen::Matrix2d covariance = kSigmaOfRoughPoints_px * kSigmaOfRoughPoints_px * Eigen::Matrix2d::Identity();
  LedReadings readings;
  for (const LedView& view : seen) {
    readings.push_back({view, std::vector<Eigen::Matrix2d>(view.pixels.size(), covariance)});
    readings.back().view.station = 0;
  }
  const auto pose = probe_pose(rig, readings);
  if (!pose) return tl::unexpected(pose.error());
  return pose->world_from_probe;
}

}  // namespace crumple
