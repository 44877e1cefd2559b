#include "datasets/pose_yaml.h"

#include <cmath>

#include <fmt/format.h>

#include "datasets/limits.h"
#include "datasets/yaml_values.h"

namespace crumple {
namespace {

constexpr double kRounding = 1e-9;

}  // namespace

std::string pose_yaml(const Pose& pose, int indent) {
  const Eigen::Quaterniond& q = pose.rotation;
  const Eigen::Vector3d& t = pose.translation;
  return fmt::format("{0:{1}}quaternion_wxyz: [{2}, {3}, {4}, {5}]\n{0:{1}}translation_mm: [{6}, {7}, {8}]\n", "",
                     indent, q.w(), q.x(), q.y(), q.z(), t.x(), t.y(), t.z());
}

Pose read_pose(const YamlValue& value) {
  Pose pose;
  YamlMap map = value.map();
  if (const auto rotation = map.require("quaternion_wxyz", "[w, x, y, z]")) {
    const Eigen::Vector4d q = read_vector<4>(*rotation, -kLargestValue, kLargestValue);
    pose.rotation = Eigen::Quaterniond(q[0], q[1], q[2], q[3]);
    if (!(std::abs(pose.rotation.norm() - 1) <= kRounding)) rotation->problem("must be of unit length");
  }
  if (const auto translation = map.require("translation_mm", "[x, y, z]")) {
    pose.translation = read_vector<3>(*translation, -kLargestValue, kLargestValue);
  }
  map.finish();
  return pose;
}

}  // namespace crumple
