// Distances between the centres of balls that a tracked probe measured along a car, and how they move with the rig and
// with the stations' poses: what is known of the latter gives the uncertainty of the former.
#pragma once

#include <map>
#include <vector>

#include <Eigen/Core>

#include "solvers/residuals.h"
#include "tests/calib/made_car.h"

namespace crumple {

struct BallDistance {
  double found_mm = 0;
  double truth_mm = 0;
  std::map<BlockId, Eigen::RowVectorXd> d_block;  // lenses and mounts of camera and projector, stations
  double decoding_mm2 = 0;                        // variance from the balls' own readings
};

// Of all balls that are `least_mm` apart or more; a ball's centre is the mean over its stations. Fails where a reading
// has no point.
Expected<std::vector<BallDistance>> ball_distances(const Rig& rig, const std::vector<Pose>& world_from_probe,
                                                   const MadeCar& car, double least_mm);

}  // namespace crumple
