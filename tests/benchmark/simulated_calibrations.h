// A scene's boards seen again and again under new detector noise, in memory: what a calibration takes, and the truth of
// every single observation beside it.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "calib/calibrate.h"
#include "datasets/render/scene.h"
#include "solvers/expected.h"

namespace crumple {

// One noise realisation. `truth` is `data.observations` with the corners and coordinates the measurement model says.
struct SimulatedCalibration {
  std::uint64_t seed = 0;
  CalibrationData data;
  Observations truth;
};

// Light is traced once per placement, so what the renderer's own sampling does to it is common to all seeds. One camera
// and a projector. `report` is called after each placement. Fails where a board is not found or not lit.
Expected<std::vector<SimulatedCalibration>> simulate_calibrations(
    const Scene& scene, const std::vector<std::uint64_t>& seeds, int threads,
    const std::function<void(const std::string&)>& report);

// The same with the truth and independent normal noise in place of what was observed.
CalibrationData with_true_corners(const SimulatedCalibration& simulated, double sigma_px);
CalibrationData with_true_stripes(const SimulatedCalibration& simulated, double sigma_px);

// How observations err, over all seeds. The common part is the mean over the seeds: of a corner's error, and of the
// mean error of one view's readings in one orientation.
struct ObservationErrors {
  double corner_rms_px = 0;  // per coordinate
  double corner_common_rms_px = 0;
  Eigen::Vector2d corner_mean_px = Eigen::Vector2d::Zero();
  double stripe_rms_px = 0;
  double stripe_common_rms_px = 0;
  double stripe_mean_px = 0;
};

ObservationErrors observation_errors(const std::vector<SimulatedCalibration>& all);

}  // namespace crumple
