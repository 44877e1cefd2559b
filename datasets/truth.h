// The truth beside a simulated capture (datasets/simulate.h), and how far a cloud is from it.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "datasets/render/scene.h"
#include "recon/cloud.h"
#include "solvers/expected.h"
#include "solvers/rig.h"

namespace crumple {

// The sensors as they were rendered; no covariance. `folder` is the capture's truth/.
Expected<Rig> read_true_rig(const std::filesystem::path& folder);

// The surfaces and where they stood, from truth/scene.yaml.
Expected<Scene> read_true_scene(const std::filesystem::path& folder);

// One point against the true surface, in the cloud's frame.
struct Deviation {
  double distance_mm = 0;   // to the nearest point of the surface, positive on the viewer's side
  double predicted_mm = 0;  // standard deviation of that distance, from the point's covariance; 0 where it has none
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();  // of the surface there, unit, towards the viewer
};

// One per point. The cloud must be in the probe frame with the scene's first camera as the reference, or say that its
// frame is "world", that of the scene's first tracker; its stations are named as the scene's. Fails on a station the
// scene does not have. Same result at any number of threads.
Expected<std::vector<Deviation>> deviations_from_truth(const Cloud& cloud, const Scene& scene, int threads);

// What the deviations amount to. "Trimmed" leaves out what lies further than five robust sigmas from the median.
struct DeviationSummary {
  std::size_t points = 0;
  double rms_mm = 0;
  double trimmed_rms_mm = 0;
  double trimmed_share = 0;    // of the points
  double mean_mm = 0;          // signed
  double robust_sigma_mm = 0;  // 1.4826 times the median absolute deviation from the median
  double max_mm = 0;           // absolute
  double predicted_mm = 0;     // RMS of the predicted standard deviations of the trimmed points
  // Root mean square of distance over predicted standard deviation, trimmed: 1 where the prediction is right, 0 where
  // there is none. The prediction knows of decoding alone; the rig's own error comes on top.
  double observed_over_predicted = 0;
  // Trimmed RMS, and the ratio above, after the cloud was moved rigidly onto the surface as a whole: what is left is
  // the shape's error and the noise. The move is a first-order one (Chen and Medioni 1992, one step).
  double moved_rms_mm = 0;
  double moved_over_predicted = 0;
  double moved_all_rms_mm = 0;  // after the same move, over all points
};

// Precondition: as many deviations as the cloud has points.
DeviationSummary summarise(const Cloud& cloud, const std::vector<Deviation>& deviations);

// The deviations after the one rigid move onto the surface that "moved" figures are of: where the frame is nobody's,
// such as the world of the first tracker, these are what there is to see. Precondition as above.
std::vector<Deviation> moved_deviations(const Cloud& cloud, std::vector<Deviation> deviations);

}  // namespace crumple
