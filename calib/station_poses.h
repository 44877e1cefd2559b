// Where the stations of a measurement were, and how that depends on the rig they were posed with.
//
// A station's pose is found from LED pixels with the rig, so an error of the rig moves it:
//
//   d pose = G d rig + noise,   G = -(Jp' W Jp)^-1 Jp' W Jr
//
// with Jp and Jr the derivatives of the LEDs' residuals by pose and by rig, W the pixels' information (the implicit
// function theorem at the minimum of tracking/probe_pose.h; terms of the residuals' own size are left out). The noise
// is that of the LED pixels. Trackers' lenses and mounts and the LEDs' places are in G: what they are wrong by moves
// all stations together, each in its own way, and only so do distances between stations get their uncertainty right.
//
// Frames and units: tangents of world_from_probe as in solvers/pose.h (rotation first, rad and mm); columns of G are
// the rows of the rig's covariance.
// Trackers may turn out noisier at a measurement than the pixels' covariances, which the rig's own residuals told,
// have it: `noisier` is how many times as much the LEDs of each group scatter (calib/rig_check.h). That is told
// afterwards, so it changes what is said of a pose, not the pose: with C' the covariances as they turned out,
//
//   covariance of the noise = A C' A',   A = (Jp' W Jp)^-1 Jp' W
#pragma once

#include <map>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "solvers/expected.h"
#include "solvers/rig.h"
#include "tracking/led_reading.h"

namespace crumple {

struct PosedStation {
  std::string name;
  Pose world_from_probe;
};

// One camera's view of a station.
struct MeasuredView {
  std::size_t station = 0;  // of StationPoses
  std::size_t camera = 0;   // of the rig
  std::size_t projector = 0;
  std::vector<double> angles_rad;  // of the stripe orientations that its points were made of
};

struct StationPoses {
  std::vector<PosedStation> stations;
  Eigen::MatrixXd d_rig;            // 6 rows per station: by the rows of the rig's covariance
  Eigen::MatrixXd covariance;       // 6 per station both ways: of what the rig does not explain
  std::vector<MeasuredView> views;  // as CloudPoint::view counts them
};

// One station more. Its noise has nothing in common with the others'.
void add_station(const PosedStation& station, const Eigen::MatrixXd& d_rig, const Matrix6d& covariance,
                 StationPoses& poses);

// Group, as in Rig::sigma_px, to factor; what is not named is as the rig says.
using NoiseFactors = std::map<std::string, double>;

// G of one station, for the readings that its pose was made of. Zero columns for what no LED pixel depends on. Fails
// where the lens has no pixel for an LED and where the readings do not determine a pose.
Expected<Eigen::MatrixXd> d_pose_d_rig(const Rig& rig, const LedReadings& used, const Pose& world_from_probe);

// What LED pixels alone leave open of a pose that they were fitted by. Fails as above.
Expected<Matrix6d> pose_covariance(const Rig& rig, const LedReadings& used, const Pose& world_from_probe,
                                   const NoiseFactors& noisier);

// How badly a station's LEDs fit its pose, the rig's own uncertainty allowed for.
struct PoseMisfit {
  double chi_square = 0;
  int redundancy = 0;      // 0: nothing checks the pose
  double probability = 1;  // of as much or more by chance
};

// The least r' S^-1 r over poses, S = C' + Jr R Jr' with R the rig's covariance: to first order at the pose. Fails as
// above.
Expected<PoseMisfit> pose_misfit(const Rig& rig, const LedReadings& used, const Pose& world_from_probe,
                                 const NoiseFactors& noisier);

}  // namespace crumple
