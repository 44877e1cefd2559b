#include "recon/move_cloud.h"

namespace crumple {

Cloud moved(Cloud cloud, const Pose& target_from_cloud, const std::string& frame) {
  const Eigen::Matrix3f rotation = target_from_cloud.rotation.toRotationMatrix().cast<float>();
  for (CloudPoint& point : cloud.points) {
    point.position_mm = target_from_cloud * point.position_mm;
    point.normal = rotation * point.normal;
    const Eigen::Matrix3f covariance = rotation * point.covariance_mm2 * rotation.transpose();
    point.covariance_mm2 = 0.5f * (covariance + covariance.transpose());
  }
  cloud.frame = frame;
  return cloud;
}

}  // namespace crumple
