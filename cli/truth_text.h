// An estimated rig beside the true one of a simulated capture.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "cli/verb.h"
#include "solvers/expected.h"
#include "solvers/rig.h"

namespace crumple {

struct ParameterTruth {
  std::string name;  // as in RigCovariance, such as "cam0.fx"
  double estimate = 0;
  double truth = 0;
  double error =
      0;  // estimate - truth; of a mount the step from the truth to the estimate (local_step of solvers/pose.h)
  double sigma = 0;  // predicted
  double z = 0;      // error / sigma
};

// Every lens and mount parameter that has a row in the estimate's covariance, in its order; the board's warp is no part
// of a rig. Mounts are relative to the estimate's first sensor: rotation vector in rad, translation in mm. Fails where
// the truth lacks a sensor or has another lens model there.
Expected<std::vector<ParameterTruth>> compare_with_true_rig(const Rig& estimated, const Rig& truth);

// {"parameters": [{name, estimate, truth, error, sigma, z}], "share_within_3_sigma": 0..1, "rms_z"}
nlohmann::json rig_truth_json(const std::vector<ParameterTruth>& parameters);
std::string rig_truth_text(const std::vector<ParameterTruth>& parameters);

// Both, for the truth in `folder`, into what a verb answers: the document's `truth` and the end of the text.
Expected<void> add_rig_truth(const std::filesystem::path& folder, const Rig& estimated, VerbResult& result);

}  // namespace crumple
