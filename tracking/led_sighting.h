// One LED of the probe seen by one tracker, with all that predicts its pixel; and the residual that every pose from
// pixels minimises:
//
//   r = lens(sensor_from_world * world_from_probe * led) - pixel,   px, predicted minus measured
#pragma once

#include <cstddef>
#include <vector>

#include <Eigen/Core>

#include "solvers/expected.h"
#include "solvers/rig.h"
#include "tracking/led_reading.h"

namespace crumple {

struct LedSighting {
  std::size_t sensor = 0;  // indices of the rig
  std::size_t led = 0;
  const Lens* lens = nullptr;  // the rig's, which must outlive this
  Pose sensor_from_world;
  Eigen::Vector3d led_mm = Eigen::Vector3d::Zero();  // in the probe frame
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();
  Eigen::Matrix2d covariance_px2 = Eigen::Matrix2d::Identity();
  Eigen::Matrix2d information = Eigen::Matrix2d::Identity();
};

// Reference LEDs in the room are passed over. Fails on an index that the rig does not have, a sensor that is no camera
// fixed to the world, and pixels or covariances that are not sound.
Expected<std::vector<LedSighting>> led_sightings(const Rig& rig, const LedReadings& readings);

using Matrix2x6d = Eigen::Matrix<double, 2, 6>;

struct SightingResidual {
  Eigen::Vector2d residual_px;
  Matrix2x6d d_pose;  // by the tangent of world_from_probe (solvers/pose.h)
};

// False where the lens has no pixel for the LED.
bool evaluate(const LedSighting& sighting, const Pose& world_from_probe, SightingResidual& at);

}  // namespace crumple
