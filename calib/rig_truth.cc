#include "calib/rig_truth.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <fmt/format.h>

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
    const Pose estimated_mount = sensor.sensor_from_mount * estimated.sensors.front().sensor_from_mount.inverse();
    const Pose true_mount = known.sensor_from_mount * truth.sensors[*reference].sensor_from_mount.inverse();
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

}  // namespace crumple
