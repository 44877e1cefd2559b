#include "tracking/pose_stream.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "tracking/median.h"

namespace crumple {
namespace {

constexpr double kLargestGap = 3.5;

double median_step(const std::vector<StampedPose>& poses) {
  std::vector<double> steps;
  for (std::size_t i = 1; i < poses.size(); ++i) steps.push_back(poses[i].time_s - poses[i - 1].time_s);
  return median_of(steps);
}

}  // namespace

Expected<PoseStream> PoseStream::create(const std::vector<StampedPose>& poses) {
  PoseStream stream;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    StampedPose pose = poses[i];
    Eigen::Quaterniond& q = pose.fixed_from_moving.rotation;
    if (!std::isfinite(pose.time_s) || !pose.fixed_from_moving.translation.allFinite() || !q.coeffs().allFinite() ||
        !(q.norm() > 0)) {
      return fail(fmt::format("pose {} is no pose: a number is not finite, or the quaternion has no length", i + 1));
    }
    q.normalize();
    if (!stream.poses_.empty() && pose.time_s == stream.last_s()) {
      ++stream.repeated_;
      continue;
    }
    if (!stream.poses_.empty() && pose.time_s < stream.last_s()) {
      return fail(fmt::format("pose {} is older than the one before it; sort the poses by time", i + 1));
    }
    stream.poses_.push_back(pose);
  }
  if (stream.poses_.size() < 2) {
    return fail(fmt::format("a stream needs at least two poses at different times{}",
                            poses.size() < 2 ? "" : "; lists that belong together line by line need none (--paired)"));
  }
  stream.median_step_s_ = median_step(stream.poses_);
  return stream;
}

std::optional<MovingPose> PoseStream::at(double time_s) const {
  if (!(time_s >= first_s() && time_s <= last_s())) return std::nullopt;
  auto after = std::upper_bound(poses_.begin(), poses_.end(), time_s,
                                [](double time, const StampedPose& pose) { return time < pose.time_s; });
  if (after == poses_.end()) --after;
  const Pose& from = (after - 1)->fixed_from_moving;
  const double gap_s = after->time_s - (after - 1)->time_s;
  if (gap_s > kLargestGap * median_step_s_) return std::nullopt;
  const double since_s = time_s - (after - 1)->time_s;
  const Vector6d step = local_step(from, after->fixed_from_moving) / gap_s;
  return MovingPose{retract(from, since_s * step), {step.head<3>(), step.tail<3>()}};
}

}  // namespace crumple
