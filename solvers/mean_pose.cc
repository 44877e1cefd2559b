#include "solvers/mean_pose.h"

#include "solvers/decompositions.h"

namespace crumple {

Pose mean_pose(const std::vector<Pose>& poses) {
  Eigen::Matrix4d outer = Eigen::Matrix4d::Zero();
  Pose mean;
  for (const Pose& pose : poses) {
    outer += pose.rotation.coeffs() * pose.rotation.coeffs().transpose();
    mean.translation += pose.translation / static_cast<double>(poses.size());
  }
  const SymmetricEigen eigen = symmetric_eigen(outer);
  mean.rotation = Eigen::Quaterniond(Eigen::Vector4d(eigen.vectors.col(3)));
  return mean;
}

}  // namespace crumple
