#include "cli/truth_text.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <fmt/format.h>

#include "datasets/truth.h"

namespace crumple {
namespace {

constexpr std::array<const char*, 6> pose_names{"rotation_x",    "rotation_y",    "rotation_z",
                                                "translation_x", "translation_y", "translation_z"};

Vector6d pose_vector(const Pose& pose) {
  Vector6d vector;
  vector << rotation_vector(pose.rotation), pose.translation;
  return vector;
}

// The parameters of one sensor by their names, without sigma.
std::vector<ParameterTruth> parameters_of(const Sensor& estimate, const Sensor& truth, const Pose& estimated_mount,
                                          const Pose& true_mount) {
  std::vector<ParameterTruth> parameters;
  const std::vector<std::string> lens_names = lens_parameter_names(estimate.lens.model());
  for (std::size_t i = 0; i < lens_names.size(); ++i) {
    const double estimated = estimate.lens.parameters()[i];
    const double known = truth.lens.parameters()[i];
    parameters.push_back({estimate.name + "." + lens_names[i], estimated, known, estimated - known});
  }
  const Vector6d estimated = pose_vector(estimated_mount);
  const Vector6d known = pose_vector(true_mount);
  const Vector6d error = local_step(true_mount, estimated_mount);
  for (std::size_t i = 0; i < pose_names.size(); ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    parameters.push_back({estimate.name + "." + pose_names[i], estimated[row], known[row], error[row]});
  }
  return parameters;
}

}  // namespace

Expected<std::vector<ParameterTruth>> compare_with_true_rig(const Rig& estimated, const Rig& truth) {
  std::vector<ParameterTruth> all;
  for (const Sensor& sensor : estimated.sensors) {
    const auto index = truth.find(sensor.name);
    const auto reference = truth.find(estimated.sensors.front().name);
    if (!index || !reference) return fail(fmt::format("the truth has no sensor {}", sensor.name));
    const Sensor& known = truth.sensors[*index];
    if (known.lens.model() != sensor.lens.model()) {
      return fail(fmt::format("sensor {} was estimated as {} but the truth is {}: their parameters cannot be compared",
                              sensor.name, sensor.lens.model(), known.lens.model()));
    }
    const Pose estimated_mount = sensor.sensor_from_probe * estimated.sensors.front().sensor_from_probe.inverse();
    const Pose true_mount = known.sensor_from_probe * truth.sensors[*reference].sensor_from_probe.inverse();
    const auto parameters = parameters_of(sensor, known, estimated_mount, true_mount);
    all.insert(all.end(), parameters.begin(), parameters.end());
  }
  std::vector<ParameterTruth> estimated_ones;
  for (std::size_t row = 0; row < estimated.covariance.names.size(); ++row) {
    const auto found = std::find_if(all.begin(), all.end(), [&](const ParameterTruth& parameter) {
      return parameter.name == estimated.covariance.names[row];
    });
    if (found == all.end()) continue;
    const auto i = static_cast<Eigen::Index>(row);
    found->sigma = std::sqrt(estimated.covariance.matrix(i, i));
    found->z = found->sigma > 0 ? found->error / found->sigma : 0;
    estimated_ones.push_back(*found);
  }
  return estimated_ones;
}

nlohmann::json rig_truth_json(const std::vector<ParameterTruth>& parameters) {
  nlohmann::json list = nlohmann::json::array();
  double within = 0, squares = 0;
  for (const ParameterTruth& p : parameters) {
    list.push_back({{"name", p.name},
                    {"estimate", p.estimate},
                    {"truth", p.truth},
                    {"error", p.error},
                    {"sigma", p.sigma},
                    {"z", p.z}});
    within += std::abs(p.z) <= 3 ? 1 : 0;
    squares += p.z * p.z;
  }
  const double count = std::max(1.0, static_cast<double>(parameters.size()));
  return {{"parameters", list}, {"share_within_3_sigma", within / count}, {"rms_z", std::sqrt(squares / count)}};
}

std::string rig_truth_text(const std::vector<ParameterTruth>& parameters) {
  std::string text = fmt::format("{:<22} {:>14} {:>14} {:>12} {:>12} {:>8}\n", "against the truth", "estimate", "truth",
                                 "error", "sigma", "error/s");
  std::size_t within = 0;
  for (const ParameterTruth& p : parameters) {
    text += fmt::format("  {:<20} {:>14.6f} {:>14.6f} {:>+12.6f} {:>12.6f} {:>+8.2f}\n", p.name, p.estimate, p.truth,
                        p.error, p.sigma, p.z);
    within += std::abs(p.z) <= 3 ? 1 : 0;
  }
  return text + fmt::format("within 3 sigma: {} of {}\n", within, parameters.size());
}

Expected<void> add_rig_truth(const std::filesystem::path& folder, const Rig& estimated, VerbResult& result) {
  const auto truth = read_true_rig(folder);
  if (!truth) return tl::unexpected(truth.error());
  const auto parameters = compare_with_true_rig(estimated, *truth);
  if (!parameters) return tl::unexpected(parameters.error());
  result.document["truth"] = rig_truth_json(*parameters);
  result.text += rig_truth_text(*parameters);
  return {};
}

}  // namespace crumple
