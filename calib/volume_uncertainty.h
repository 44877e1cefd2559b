// How uncertain a calibration leaves what it is for: one number for a rig, linear in its parameters' errors, so that
// planning can ask what more views would make of it.
//
// The measuring volume is a grid before the first camera on the probe (or the first in the world, of a rig without a
// probe): the middles of the image's thirds, at the least and at the largest distance at which it saw a board.
//   points      Where two sensors or more see them: the mean over the grid of a point's standard uncertainty (root of
//               the trace of its covariance, mm) in the world, triangulated by all that see it. Of a probe that is
//               moved about, over three of its stations, at which the probe is posed by its LEDs first.
//   projection  Of a camera by itself: the mean of the standard uncertainty (root of the trace, px) of where it sees
//               the grid's points, once it has been posed by them: what a pose can take up is not the lens's fault.
// Only the rig's uncertainty counts; pixels are exact, and only weigh what does not agree.
//
// With N = J'J of a point's observations by the parameters t and the unknowns u (point and pose), d u / d t =
// -N_uu^-1 N_ut.
#pragma once

#include <optional>
#include <vector>

#include <Eigen/Core>

#include "calib/calibrate.h"
#include "calib/view_information.h"

namespace crumple {

struct MeasuringVolume {
  bool triangulated = false;     // points, mm; else projection, px
  Eigen::MatrixXd d_parameters;  // of all coordinates by the blocks, side by side
  int coordinates = 3;           // of a point: 3 or 2

  // Means over the points of the root of the trace, of d_parameters C d_parameters'; `variances` is its diagonal.
  double mean_uncertainty(const Eigen::VectorXd& variances) const;
};

// A point of the grid as it is measured, and what the calibration leaves open of it: with respect to the bodies that
// the calibration saw (boards, or LEDs), whose mean motion nobody would notice (solvers/body_motion.h).
struct VolumePoint {
  int column = 0;  // thirds of the image, from 0
  int row = 0;
  double depth_mm = 0;                      // along the first camera's axis
  std::optional<std::size_t> station = {};  // at which the probe was posed
  Eigen::Matrix3d covariance_mm2 = Eigen::Matrix3d::Zero();
};

struct VolumePoints {
  std::size_t camera = 0;      // whose image is divided
  Mount frame = Mount::probe;  // of the covariances
  std::vector<VolumePoint> points;
};

// Of the points that two sensors or more see. Fails where there are none, or no body's motion is known.
Expected<VolumePoints> volume_points(const CalibrationData& data, const Calibration& calibration);

// Fails where no camera sees a board.
Expected<MeasuringVolume> measuring_volume(const CalibrationData& data, const Calibration& calibration,
                                           const std::vector<BlockId>& blocks);

// Each observation's weight as the calibration found it: its group's sigma and inflation, or those of its sensor's
// other observations. Refers to the calibration.
WeightOf weights_of(const Calibration& calibration);

// What a calibration estimated that more views would tell more of: the rig's and boards' blocks, shared lenses once,
// and the placements before which the probe stood.
std::vector<BlockId> estimated_blocks(const CalibrationData& data, const Calibration& calibration);

}  // namespace crumple
