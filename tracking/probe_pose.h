// The pose of the probe from the pixels of its LEDs in all trackers at once, the rig being known:
//
//   minimise  sum r' C^-1 r   over world_from_probe,   r as in tracking/led_sighting.h, C the pixel's covariance
//
// A start in closed form (tracking/pose_starts.h); where a fit from it leaves nothing to doubt, that is it. Otherwise
// starts from three LEDs at a time compete by their sums of squares cut at the gate, the best are refined with a Cauchy
// loss, and readings whose square, standardised by their own redundancy as in solvers/bundle.h, reaches the gate are
// left out one by one, the worst first, and taken back where they fit after all. The final fit is least squares.
//
// The covariance is the inverse information, in the tangent of solvers/pose.h (rotation first, rad and mm): of the LED
// pixels alone, not of the rig. Nothing is scaled by the fit itself: chi-square and its redundancy tell whether it may
// be believed.
//
// Refused by name: fewer than three LEDs, or LEDs on a line; LEDs spread over trackers so that none sees three and no
// two share three; readings that contradict each other with too few left to tell which are wrong; poses that explain
// the pixels alike, as three LEDs or a plane seen by one tracker allow, where no pose is stated that the probe is near,
// or one that does not decide between them.
//
// They lie along one line of sight and differ by their turn, so it is the turn of the pose stated that decides, never
// its place: it must be nearer to one of them than a third of the turn from that to any other. So a statement that is
// wrong by less than a third of that turn never decides for the wrong one, and the way it errs does not matter.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "solvers/expected.h"
#include "tracking/led_sighting.h"

namespace crumple {

// Roughly how the probe stood, and who says so: "station door_6".
struct NearPose {
  Pose world_from_probe;
  std::string source;
};

struct ProbePoseOptions {
  double gate = 16;                   // on the standardised square in two dimensions: p = 3e-4
  std::optional<NearPose> near = {};  // decides between poses that the pixels do not tell apart
};

// How one of several poses that explain the pixels alike was taken.
struct PoseChoice {
  std::size_t poses = 0;    // that explain them, the one taken included
  std::string near;         // the source of the pose stated
  double turn_rad = 0;      // from that pose to the one taken
  double place_mm = 0;      // likewise, of the probe's origin
  double to_other_rad = 0;  // turn from the one taken to the least different other
};

struct LedResidual {
  std::size_t sensor = 0;
  std::size_t led = 0;
  Eigen::Vector2d residual_px = Eigen::Vector2d::Zero();
  double standardised_square = 0;
  bool used = true;
};

struct ProbePose {
  Pose world_from_probe;
  Matrix6d covariance = Matrix6d::Zero();
  double chi_square = 0;
  int redundancy = 0;                  // 0 with three LEDs and one tracker: then nothing checks the pose
  std::vector<LedResidual> residuals;  // of all readings of the probe's LEDs, in their order
  // None where the pixels alone tell the pose; else the rest holds if the choice is right.
  std::optional<PoseChoice> choice = {};
};

Expected<ProbePose> probe_pose(const Rig& rig, const LedReadings& readings, const ProbePoseOptions& options = {});

}  // namespace crumple
