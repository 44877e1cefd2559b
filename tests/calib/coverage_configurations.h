// Configurations whose stated uncertainties are put to the test: the truth and the layout of what is observed stay,
// noise is drawn anew for each campaign, and so is what priors and certificates say.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "calib/calibration_data.h"
#include "solvers/bundle.h"
#include "tests/calib/fresh_stations.h"

namespace crumple {

// One campaign as it is handed to the refinement, and what is true of it.
struct CoverageCampaign {
  CalibrationState truth;
  CalibrationState start;
  Observations observations;
  BundleOptions options;
  // What was measured, in place of a start and observations: calibrated from nothing.
  std::optional<CalibrationData> measured = {};
};

struct CoverageConfiguration {
  std::string name;
  std::function<Expected<CoverageCampaign>(std::mt19937_64&)> draw;
  // Where weak priors hold terms, parameters mean nothing by themselves: only what they project is judged.
  bool judge_parameters = true;
  // Through rendered images: fewer campaigns, for they take long.
  bool rendered = false;
  // Measured with each campaign's rig; may be none.
  std::shared_ptr<const FreshStations> fresh = nullptr;
};

// All of them; those that take a priori knowledge calibrate once to get it. Fails where that does.
Expected<std::vector<CoverageConfiguration>> coverage_configurations();

}  // namespace crumple
