#include "calib/rig_truth.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "solvers/closed_form/rigid_fit.h"
#include "solvers/rig_covariance.h"

namespace crumple {
namespace {

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
  for (std::size_t i = 0; i < kPoseRows.size(); ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    parameters.push_back({estimate.name + "." + kPoseRows[i], estimated[row], known[row], error[row]});
  }
  return parameters;
}

const Sensor& first_on(Mount mount, const Rig& rig) {
  return *std::find_if(rig.sensors.begin(), rig.sensors.end(), [&](const Sensor& s) { return s.mount == mount; });
}

struct LedPair {
  std::string name;
  Mount mount;
  Eigen::Vector3d estimated_mm;
  Eigen::Vector3d true_mm;
};

// The LEDs that both have, in the frame of the first sensor on their mount, where the estimate has one.
std::vector<LedPair> led_pairs(const Rig& estimated, const Rig& truth) {
  std::vector<LedPair> pairs;
  for (const Led& led : estimated.leds) {
    const auto known =
        std::find_if(truth.leds.begin(), truth.leds.end(), [&](const Led& l) { return l.name == led.name; });
    const bool framed = std::any_of(estimated.sensors.begin(), estimated.sensors.end(),
                                    [&](const Sensor& s) { return s.mount == led.mount; });
    if (known == truth.leds.end() || known->mount != led.mount || !framed) continue;
    const Sensor& first = first_on(led.mount, estimated);
    const auto reference = truth.find(first.name);
    if (!reference) continue;
    pairs.push_back({led.name, led.mount, first.sensor_from_mount * led.position_mm,
                     truth.sensors[*reference].sensor_from_mount * known->position_mm});
  }
  return pairs;
}

void add_leds(const Rig& estimated, const Rig& truth, std::vector<ParameterTruth>& all,
              std::vector<std::string>& not_compared) {
  const std::vector<LedPair> pairs = led_pairs(estimated, truth);
  for (const Led& led : estimated.leds) {
    if (std::none_of(pairs.begin(), pairs.end(), [&](const LedPair& pair) { return pair.name == led.name; })) {
      not_compared.push_back(led.name);
    }
  }
  for (const LedPair& pair : pairs) {
    for (int i = 0; i < 3; ++i) {
      all.push_back(
          {pair.name + "." + "xyz"[i], pair.estimated_mm[i], pair.true_mm[i], pair.estimated_mm[i] - pair.true_mm[i]});
    }
  }
}

}  // namespace

// Poses are compared in the frame of the first sensor on the same mount.
Expected<RigTruth> compare_with_true_rig(const Rig& estimated, const Rig& truth) {
  RigTruth result;
  std::vector<ParameterTruth> all;
  for (const Sensor& sensor : estimated.sensors) {
    const auto index = truth.find(sensor.name);
    const Sensor& first = first_on(sensor.mount, estimated);
    const auto reference = truth.find(first.name);
    if (!index || !reference) {
      result.not_compared.push_back(sensor.name);
      continue;
    }
    const Sensor& known = truth.sensors[*index];
    if (known.lens.model() != sensor.lens.model()) {
      return fail(fmt::format("sensor {} was estimated as {} but the truth is {}: their parameters cannot be compared",
                              sensor.name, sensor.lens.model(), known.lens.model()));
    }
    const Pose estimated_mount = sensor.sensor_from_mount * first.sensor_from_mount.inverse();
    const Pose true_mount = known.sensor_from_mount * truth.sensors[*reference].sensor_from_mount.inverse();
    const auto parameters = parameters_of(sensor, known, estimated_mount, true_mount);
    all.insert(all.end(), parameters.begin(), parameters.end());
  }
  if (result.not_compared.size() == estimated.sensors.size()) return fail("the truth has none of the rig's sensors");
  add_leds(estimated, truth, all, result.not_compared);
  for (std::size_t row = 0; row < estimated.covariance.names.size(); ++row) {
    const auto found = std::find_if(all.begin(), all.end(), [&](const ParameterTruth& parameter) {
      return parameter.name == estimated.covariance.names[row];
    });
    if (found == all.end()) continue;
    const auto i = static_cast<Eigen::Index>(row);
    found->sigma = std::sqrt(estimated.covariance.matrix(i, i));
    found->z = found->sigma > 0 ? found->error / found->sigma : 0;
    result.parameters.push_back(*found);
  }
  return result;
}

Expected<double> lens_error_px(const Lens& estimated, const Lens& truth) {
  constexpr int kColumns = 16, kRows = 12;
  std::vector<Eigen::Vector3d> rays;  // of the true lens
  std::vector<Eigen::Vector2d> pixels;
  Eigen::Matrix3d correlation = Eigen::Matrix3d::Zero();
  for (int i = 0; i < kColumns * kRows; ++i) {
    const Eigen::Vector2d pixel((i % kColumns + 0.5) / kColumns * (truth.size().width_px - 1),
                                (i / kColumns + 0.5) / kRows * (truth.size().height_px - 1));
    const auto known = truth.ray(pixel), found = estimated.ray(pixel);
    if (!known || !found) continue;
    rays.push_back(known->normalized());
    pixels.push_back(pixel);
    correlation += found->normalized() * known->normalized().transpose();
  }
  const Eigen::Matrix3d rotation = nearest_rotation(correlation);
  double sum = 0;
  for (std::size_t k = 0; k < rays.size(); ++k) {
    const auto seen = estimated.project(rotation * rays[k]);
    if (!seen) return fail("the estimated lens does not see what the true one does");
    sum += (*seen - pixels[k]).squaredNorm();
  }
  if (rays.empty()) return fail("the lenses have no ray in common");
  return std::sqrt(sum / static_cast<double>(rays.size()));
}

Expected<HandEyeError> hand_eye_error(const Rig& estimated, const Rig& truth) {
  std::vector<Eigen::Vector3d> found, known;
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (const LedPair& pair : led_pairs(estimated, truth)) {
    if (pair.mount != Mount::probe) continue;
    found.push_back(pair.estimated_mm);
    known.push_back(pair.true_mm);
    middle += pair.true_mm;
  }
  const auto moved = rigid_fit(known, found);
  if (!moved) return fail("hand and eye against the truth: " + moved.error().message);
  middle /= static_cast<double>(known.size());
  return HandEyeError{(*moved * middle - middle).norm(), rotation_vector(moved->rotation).norm()};
}

}  // namespace crumple
