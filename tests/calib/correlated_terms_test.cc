#include "calib/correlated_terms.h"

#include <gtest/gtest.h>

namespace crumple {
namespace {

TEST(CorrelatedTerms, StrongestFirstWithTheirSigns) {
  RigCovariance covariance{{"a", "b", "c"}, Eigen::Matrix3d::Zero()};
  const Eigen::Vector3d sigma(2, 0.01, 5);
  Eigen::Matrix3d correlation;
  correlation << 1, 0.96, 0.5, 0.96, 1, -0.99, 0.5, -0.99, 1;
  covariance.matrix = sigma.asDiagonal() * correlation * sigma.asDiagonal();
  const CorrelatedTerms terms = correlated_terms(covariance);
  ASSERT_EQ(terms.pairs, 2U);
  EXPECT_EQ(terms.strongest[0].first, "b");
  EXPECT_EQ(terms.strongest[0].second, "c");
  EXPECT_NEAR(terms.strongest[0].correlation, -0.99, 1e-12);
  EXPECT_EQ(terms.strongest[1].first, "a");
}

}  // namespace
}  // namespace crumple
