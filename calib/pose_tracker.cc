#include "calib/pose_tracker.h"

#include <cassert>

#include "tracking/probe_pose.h"

namespace crumple {
namespace {

constexpr std::size_t kLeastPoints = 4;  // three have up to four poses
constexpr double kSigmaOfRoughPoints_px = 5;

}  // namespace

Expected<Pose> pose_tracker(const Lens& lens, const std::vector<Eigen::Vector3d>& in_world_mm,
                            const std::vector<Eigen::Vector2d>& pixels) {
  assert(in_world_mm.size() == pixels.size());
  if (pixels.size() < kLeastPoints) return fail("it sees fewer than four points whose places are known");
  // As if the world were a probe that this camera watches.
  Rig rig;
  rig.sensors.push_back({"tracker", SensorKind::camera, lens, {}, Mount::world});
  LedView view{0, {}, pixels, 0};
  for (const Eigen::Vector3d& point : in_world_mm) {
    view.leds.push_back(rig.leds.size());
    rig.leds.push_back({"", point, Mount::probe});
  }
  const Eigen::Matrix2d covariance = kSigmaOfRoughPoints_px * kSigmaOfRoughPoints_px * Eigen::Matrix2d::Identity();
  const LedReadings readings{{view, std::vector<Eigen::Matrix2d>(pixels.size(), covariance)}};
  const auto pose = probe_pose(rig, readings);
  if (!pose) return tl::unexpected(pose.error());
  return pose->world_from_probe;
}

}  // namespace crumple
