// A made tracked probe at two stations, exact, for tests of what its uncertainty does to points.
#pragma once

#include <cmath>
#include <random>
#include <string>
#include <vector>

#include "calib/station_poses.h"
#include "solvers/parameters.h"
#include "solvers/stripe_point.h"
#include "tests/solvers/made_system.h"
#include "tracking/probe_pose.h"

namespace crumple {

inline constexpr double kLedSigma_px = 0.05;
inline const Eigen::Vector2d kColumns = Eigen::Vector2d::UnitX();

// A rig, and two stations of its probe with what their trackers saw, exact.
struct TrackedProbe {
  CalibrationState truth;
  std::vector<LedReadings> readings;

  TrackedProbe() {
    const MadeSystem made =
        make_system({.stations = 2, .tracker_placements = 1, .led_sigma_px = 0, .corner_sigma_px = 0});
    truth = made.truth;
    readings.resize(2);
    for (const LedView& view : made.observations.leds) {
      if (!view.station) continue;
      const std::vector<Eigen::Matrix2d> noise(view.leds.size(),
                                               kLedSigma_px * kLedSigma_px * Eigen::Matrix2d::Identity());
      readings[*view.station].push_back({view, noise});
    }
    std::vector<BlockId> blocks;
    using Kind = BlockId::Kind;
    for (std::size_t s = 0; s < truth.rig.sensors.size(); ++s) {
      blocks.push_back({Kind::lens, s});
      if (s != 0 && s != *truth.rig.find("track0")) blocks.push_back({Kind::mount, s});
    }
    for (std::size_t l = 0; l < truth.rig.leds.size(); ++l) blocks.push_back({Kind::led, l});
    for (const BlockId& block : blocks) {
      const std::vector<std::string> names = parameter_names(block, truth);
      for (std::size_t i = 0; i < names.size(); ++i) rows.push_back({block, static_cast<int>(i)});
      truth.rig.covariance.names.insert(truth.rig.covariance.names.end(), names.begin(), names.end());
    }
  }

  struct Row {
    BlockId block;
    int index = 0;
  };
  std::vector<Row> rows;  // of the covariance

  Eigen::Index size() const { return static_cast<Eigen::Index>(rows.size()); }

  Rig moved(const Eigen::VectorXd& step) const {
    CalibrationState state = truth;
    for (std::size_t i = 0; i < rows.size(); ++i) {
      Eigen::VectorXd tangent = Eigen::VectorXd::Zero(tangent_size(rows[i].block, state));
      tangent[rows[i].index] = step[static_cast<Eigen::Index>(i)];
      move_block(rows[i].block, tangent, state);
    }
    return state.rig;
  }

  // A step of each parameter that moves pixels by some hundredths.
  double scale_of(std::size_t row) const {
    const std::string& name = truth.rig.covariance.names[row];
    if (name.find("rotation") != std::string::npos) return 2e-5;
    if (name.find(".f") != std::string::npos || name.find(".c") != std::string::npos) return 0.03;
    if (name.find(".k") != std::string::npos || name.find(".p") != std::string::npos) return 1e-4;
    return 0.02;  // mm
  }

  StationPoses poses(const Rig& rig, const std::vector<LedReadings>& seen) const {
    StationPoses result;
    for (std::size_t s = 0; s < seen.size(); ++s) {
      const ProbePose pose = probe_pose(rig, seen[s]).value();
      add_station({"station", pose.world_from_probe}, d_pose_d_rig(rig, seen[s], pose.world_from_probe).value(),
                  pose.covariance, result);
    }
    for (std::size_t s = 0; s < seen.size(); ++s) result.views.push_back({s, 0, 1, {0}});
    return result;
  }
};

// The root of a covariance that ties all parameters together.
inline Eigen::MatrixXd correlated_root(const TrackedProbe& probe, std::mt19937& random) {
  std::normal_distribution<double> normal;
  Eigen::MatrixXd root(probe.size(), probe.size());
  for (Eigen::Index i = 0; i < root.size(); ++i)
    root(i) = normal(random) / std::sqrt(2.0 * static_cast<double>(root.rows()));
  root.diagonal().array() += std::sqrt(0.5);
  for (Eigen::Index i = 0; i < root.rows(); ++i) root.row(i) *= probe.scale_of(static_cast<std::size_t>(i));
  return root;
}

// A rig that is off as the root's covariance says.
inline Rig drawn_rig(const TrackedProbe& probe, const Eigen::MatrixXd& root, std::mt19937& random) {
  std::normal_distribution<double> normal;
  Eigen::VectorXd step(probe.size());
  for (double& value : step) value = normal(random);
  return probe.moved(root * step);
}

inline std::vector<LedReadings> drawn_readings(const TrackedProbe& probe, std::mt19937& random) {
  std::normal_distribution<double> normal;
  std::vector<LedReadings> seen = probe.readings;
  for (LedReadings& station : seen) {
    for (LedReading& reading : station) {
      for (Eigen::Vector2d& pixel : reading.view.pixels) {
        pixel.x() += kLedSigma_px * normal(random);
        pixel.y() += kLedSigma_px * normal(random);
      }
    }
  }
  return seen;
}

struct StripeReading {
  std::size_t station = 0;
  Eigen::Vector2d pixel;
  double coordinate_px = 0;
};

inline StripeReading reading_of(const TrackedProbe& probe, std::size_t station, const Eigen::Vector3d& in_probe) {
  const std::vector<Sensor>& sensors = probe.truth.rig.sensors;
  return {station, sensors[0].lens.project(sensors[0].sensor_from_mount * in_probe).value(),
          stripe_coordinate(sensors[1], kColumns, in_probe)->value_px};
}

inline Eigen::Vector3d in_world(const Rig& rig, const StripeReading& reading, const std::vector<LedReadings>& seen) {
  const auto point =
      stripe_point(rig.sensors[0], rig.sensors[1], kColumns, reading.pixel, reading.coordinate_px, false);
  return probe_pose(rig, seen[reading.station])->world_from_probe * point->in_probe;
}

}  // namespace crumple
