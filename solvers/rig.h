// A rig: sensors rigidly mounted on one probe. A projector is a sensor that emits; nothing else tells it from a camera.
#pragma once

#include <cstddef>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "solvers/lens.h"
#include "solvers/pose.h"

namespace crumple {

enum class SensorKind { camera, projector };

struct Sensor {
  std::string name;
  SensorKind kind = SensorKind::camera;
  Lens lens;
  Pose sensor_from_probe;  // the probe frame is the frame of the reference sensor: identity there
};

// The joint covariance of rig parameters in tangent coordinates; row i is parameter names[i], such as "cam0.fx" (px) or
// "proj0.rotation_x" (rad), "proj0.translation_x" (mm). Parameters held fixed have no row.
struct RigCovariance {
  std::vector<std::string> names;
  Eigen::MatrixXd matrix;
};

struct Rig {
  std::vector<Sensor> sensors;
  RigCovariance covariance;  // empty where none was estimated
  // Standard deviation of one measured coordinate, px, per group of observations, such as "cam0.corners".
  std::map<std::string, double> sigma_px;

  std::optional<std::size_t> find(const std::string& name) const;
};

}  // namespace crumple
