#include "tracking/serial_correlation.h"

#include <cmath>
#include <random>

#include <gtest/gtest.h>

namespace crumple {
namespace {

// An autoregressive series of unit variance: its mean's variance is (1 + c) / (1 - c) / n.
Eigen::MatrixXd series(double c, Eigen::Index n) {
  std::mt19937 random(3);
  std::normal_distribution<double> normal;
  Eigen::MatrixXd r(n, 1);
  double value = normal(random);
  for (Eigen::Index i = 0; i < n; ++i) r(i, 0) = value = c * value + std::sqrt(1 - c * c) * normal(random);
  return r;
}

TEST(SerialCorrelation, LeavesWhiteResidualsTheirVariance) {
  const Eigen::MatrixXd r = series(0, 4000);
  EXPECT_EQ(correlation_reach(r), 0);
  EXPECT_NEAR(serial_covariance(Eigen::MatrixXd::Identity(1, 1) / 4000, r, 0)(0, 0) * 4000, 1, 0.1);
}

TEST(SerialCorrelation, RaisesTheVarianceOfCorrelatedOnes) {
  const Eigen::MatrixXd r = series(0.9, 20000);
  const int reach = correlation_reach(r);
  EXPECT_GT(reach, 20);
  EXPECT_LT(reach, 80);
  const double inflation = serial_covariance(Eigen::MatrixXd::Identity(1, 1) / 20000, r, reach)(0, 0) * 20000;
  EXPECT_NEAR(inflation, 19, 5);
}

}  // namespace
}  // namespace crumple
