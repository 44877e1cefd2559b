// What `crumple reconstruct` says of its clouds: summary.json (docs/formats.md) and a page of text.
#pragma once

#include <map>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "datasets/truth.h"
#include "recon/station.h"

namespace crumple {

// One camera's frames at one station, by one estimator.
struct ReconstructedView {
  std::string station;
  std::string camera;
  std::string estimator;
  std::size_t points = 0;
  double decoded_fraction = 0;
  double median_sigma_mm = 0;
  std::vector<OrientationReport> orientations;
};

struct FailedView {
  std::string station;
  std::string camera;
  std::string reason;
};

struct EstimatorTruth {
  std::string estimator;
  DeviationSummary summary;
};

struct Reconstruction {
  std::vector<std::string> estimators;  // the first one's cloud is the main one
  std::vector<ReconstructedView> views;
  std::vector<FailedView> failed;
  std::vector<EstimatorTruth> truth;  // empty without --truth
  // The main estimator by rigs beside the main one ("joint"), by their names; empty without --compare.
  std::vector<EstimatorTruth> compared = {};

  std::size_t points(const std::string& estimator) const;
};

nlohmann::json reconstruction_summary(const Reconstruction& reconstruction);
std::string reconstruction_text(const Reconstruction& reconstruction);

}  // namespace crumple
