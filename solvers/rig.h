// A rig: sensors, each mounted on the probe or fixed to the world, and LEDs. A projector is a sensor that emits; a
// tracker is a camera fixed to the world; nothing else tells them from other cameras. Any number of each, none of any
// kind.
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

// What carries a sensor or an LED. The probe frame is the frame of the first sensor on the probe; the world frame is
// that of the first sensor fixed to the world or, where there is none, the probe's own (a probe that stands still).
enum class Mount { probe, world };

// A tracker that is moved between set-ups is one sensor per set-up, each with its own mount; the later ones share the
// lens of the first.
struct Sensor {
  std::string name;
  SensorKind kind = SensorKind::camera;
  Lens lens;
  Pose sensor_from_mount;  // identity for the sensor whose frame is the mount's
  Mount mount = Mount::probe;
  std::optional<std::size_t> lens_of = {};  // the earlier sensor whose lens this is; that one has its own
};

// A light that trackers see: one of the probe's, or a reference in the room.
struct Led {
  std::string name;
  Eigen::Vector3d position_mm = Eigen::Vector3d::Zero();  // in its mount's frame
  Mount mount = Mount::probe;
};

// The joint covariance of rig parameters in tangent coordinates; row i is parameter names[i], such as "cam0.fx" (px) or
// "proj0.rotation_x" (rad), "proj0.translation_x" (mm). Parameters held fixed have no row.
struct RigCovariance {
  std::vector<std::string> names;
  Eigen::MatrixXd matrix;
};

struct Rig {
  std::vector<Sensor> sensors;
  std::vector<Led> leds = {};
  RigCovariance covariance;  // empty where none was estimated
  // Standard deviation of one measured coordinate, px, per group of observations, such as "cam0.corners".
  std::map<std::string, double> sigma_px;
  // What the uncertainty of the boards' scales in the covariance does not contain, in words, such as a thermal
  // expansion that no certificate states. Empty where it is complete, and where no scale has a row.
  std::vector<std::string> scale_lacks = {};
  // What its calibration's verdict said against it, sentences; empty where that was nothing, or is not known.
  std::vector<std::string> doubts = {};
  bool rejected = false;  // with doubts: numbers that nobody is to use

  std::optional<std::size_t> find(const std::string& name) const;
};

}  // namespace crumple
