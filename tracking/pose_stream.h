// Time-stamped poses of something that moves, such as a hand that a tracker or an arm reports.
//
// Between two poses the motion is taken as even: constant velocity, and a constant angular rate about one axis (slerp).
// Times are seconds of the stream's own clock, lengths mm.
#pragma once

#include <optional>
#include <vector>

#include <Eigen/Core>

#include "solvers/expected.h"
#include "solvers/pose.h"

namespace crumple {

struct StampedPose {
  double time_s = 0;
  Pose fixed_from_moving;
};

// How a pose changes: R <- exp([w]x dt) R, t <- t + v dt; both in the fixed frame.
struct PoseRate {
  Eigen::Vector3d angular_rad_s = Eigen::Vector3d::Zero();
  Eigen::Vector3d linear_mm_s = Eigen::Vector3d::Zero();
};

struct MovingPose {
  Pose fixed_from_moving;
  PoseRate rate;
};

class PoseStream {
 public:
  // Times must not decrease. Of poses with equal times the first is kept. Fails, naming the pose by its number from 1,
  // on fewer than two poses, decreasing times, numbers that are not finite and quaternions of no length; quaternions
  // are brought to unit length.
  static Expected<PoseStream> create(const std::vector<StampedPose>& poses);

  const std::vector<StampedPose>& poses() const { return poses_; }
  double first_s() const { return poses_.front().time_s; }
  double last_s() const { return poses_.back().time_s; }
  double median_step_s() const { return median_step_s_; }
  std::size_t repeated() const { return repeated_; }  // how many poses had the time of the one before

  // None outside of the stream, and in gaps of more than three and a half median steps, where even motion is a guess.
  std::optional<MovingPose> at(double time_s) const;

 private:
  std::vector<StampedPose> poses_;
  double median_step_s_ = 0;
  std::size_t repeated_ = 0;
};

}  // namespace crumple
