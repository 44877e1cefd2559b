#include "recon/move_cloud.h"

#include <gtest/gtest.h>

namespace crumple {
namespace {

TEST(MoveCloud, TurnsPointsNormalsAndCovariancesAlike) {
  Cloud cloud;
  CloudPoint point;
  point.position_mm = {10, 0, 0};
  point.normal = {0, 0, -1};
  point.covariance_mm2 = Eigen::Vector3f(4, 1, 9).asDiagonal();
  cloud.points = {point};
  // A quarter of a turn about z, x to y.
  const Pose pose{rotation_from_vector({0, 0, std::acos(-1.0) / 2}), {1, 2, 3}};
  const Cloud there = moved(cloud, pose, "world");
  EXPECT_EQ(there.frame, "world");
  EXPECT_LT((there.points[0].position_mm - Eigen::Vector3d(1, 12, 3)).norm(), 1e-12);
  EXPECT_LT((there.points[0].normal - Eigen::Vector3f(0, 0, -1)).norm(), 1e-6f);
  EXPECT_LT((there.points[0].covariance_mm2.diagonal() - Eigen::Vector3f(1, 4, 9)).norm(), 1e-5f);
}

}  // namespace
}  // namespace crumple
