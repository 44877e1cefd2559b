// What `crumple reconstruct` says of its clouds: summary.json (docs/formats.md) and a page of text.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include "cli/posed_rig.h"
#include "datasets/truth.h"
#include "recon/clean.h"
#include "recon/merge.h"
#include "recon/station.h"
#include "tracking/probe_pose.h"

namespace crumple {

// One camera's frames at one station, by one estimator.
struct ReconstructedView {
  std::string station;
  std::string camera;
  std::string estimator;
  std::size_t points = 0;  // before cleaning
  double decoded_fraction = 0;
  double median_sigma_mm = 0;
  std::vector<OrientationReport> orientations;
  RemovedPoints removed;
};

// One estimator's cloud as it is written.
struct WrittenCloud {
  std::string estimator;
  std::size_t points = 0;
  std::optional<MergeReport> merged;
  std::size_t not_smoothed = 0;
  // By view, of StationOverlap::offset_mm, as far as rig and poses tell; of the main cloud.
  std::map<std::size_t, double> offset_sigmas_mm = {};
};

struct FailedView {
  std::string station;
  std::string camera;
  std::string reason;
};

struct EstimatorTruth {
  std::string estimator;
  DeviationSummary summary;
  bool in_world = false;

  // Over all points; in the world frame, which is nobody's, after one rigid move onto the surface.
  double cloud_rms_mm() const { return in_world ? summary.moved_all_rms_mm : summary.rms_mm; }
};

struct Reconstruction {
  std::vector<std::string> estimators;  // the first one's cloud is the main one
  std::vector<ReconstructedView> views;
  std::vector<FailedView> failed;
  std::vector<std::pair<std::string, PoseChoice>> choices = {};  // by station, where LEDs leave several poses
  std::vector<std::string> stillness_not_tested = {};            // stations of a tracked probe
  std::vector<WrittenCloud> clouds;                              // one per estimator
  std::vector<EstimatorTruth> truth;                             // empty without --truth
  // The main estimator by rigs beside the main one ("joint"), by their names; empty without --compare.
  std::vector<EstimatorTruth> compared = {};
  PosedRig rig = {};            // of a tracked probe, posed by pixels
  nlohmann::json refined = {};  // of --refine_stations; else null
  std::string refined_text = {};
  nlohmann::json uncertainty = {};  // of the main cloud's points
  std::string uncertainty_text = {};
};

// Stations that lie off those before them, where they overlap, by more than rig and poses allow: sentences.
std::vector<std::string> stations_off(const Reconstruction& reconstruction);

nlohmann::json reconstruction_summary(const Reconstruction& reconstruction);
std::string reconstruction_text(const Reconstruction& reconstruction);

}  // namespace crumple
