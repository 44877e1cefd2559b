// A scene's boards rendered and measured in memory: what a calibration takes, and the truth of every single observation
// beside it.
#pragma once

#include <cstdint>
#include <vector>

#include "calib/calibrate.h"
#include "datasets/render/scene.h"
#include "solvers/expected.h"

namespace crumple {

// `truth` is `data.observations` with the corners and coordinates the measurement model says.
struct SimulatedCalibration {
  std::uint64_t seed = 0;
  CalibrationData data;
  Observations truth;
};

// The scene with the renderer's sampling and the detector's noise drawn from `seed`, and every board moved by up to
// 8 mm and 3 degrees about each axis (evenly distributed): a campaign of its own, sharing no error with another.
Scene redrawn(const Scene& scene, std::uint64_t seed);

// One camera and a projector. Fails where a board is not found or not lit.
Expected<SimulatedCalibration> simulate_calibration(const Scene& scene, int threads);

// The same with the truth and independent normal noise in place of what was observed.
CalibrationData with_true_corners(const SimulatedCalibration& simulated, double sigma_px);
CalibrationData with_true_stripes(const SimulatedCalibration& simulated, double sigma_px);

// How observations err, over all campaigns.
struct ObservationErrors {
  double corner_rms_px = 0;  // per coordinate
  Eigen::Vector2d corner_mean_px = Eigen::Vector2d::Zero();
  double corner_view_mean_rms_px = 0;  // of the mean error of a view's corners, per coordinate
  double stripe_rms_px = 0;
  double stripe_mean_px = 0;
  double stripe_view_mean_rms_px = 0;  // of the mean error of one view's readings in one orientation
};

ObservationErrors observation_errors(const std::vector<SimulatedCalibration>& all);

}  // namespace crumple
