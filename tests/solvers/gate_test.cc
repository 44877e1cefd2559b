#include "solvers/gate.h"

#include <cmath>
#include <random>

#include <gtest/gtest.h>

namespace crumple {
namespace {

Eigen::Matrix2d diagonal(double first, double second) { return Eigen::Vector2d(first, second).asDiagonal(); }

TEST(Gate, OneDimensionIsCutAsOftenAsTwo) {
  EXPECT_NEAR(gate_for(1, 16), 12.87, 0.01);
  std::mt19937_64 generator(1);
  std::normal_distribution<double> normal;
  for (const int d : {1, 2}) {
    double sum = 0;
    int kept = 0;
    for (int i = 0; i < 200000; ++i) {
      double s = 0;
      for (int k = 0; k < d; ++k) s += std::pow(normal(generator), 2);
      if (s > gate_for(d, 6)) continue;
      sum += s;
      ++kept;
    }
    EXPECT_NEAR(sum / kept / d, kept_variance(d, 6), 0.01);
  }
}

TEST(StandardisedSquare, IsOfTheRedundancyOrTheVarianceOfThePrediction) {
  const Eigen::Vector2d residual(3, 1);
  const auto sure = standardised_square(residual, diagonal(0, 0), true, false);
  EXPECT_DOUBLE_EQ(sure.value, 10);
  EXPECT_EQ(sure.freedom, 2);
  EXPECT_DOUBLE_EQ(standardised_square(residual, diagonal(0.5, 0.75), true, false).value, 9 / 0.5 + 1 / 0.25);
  EXPECT_DOUBLE_EQ(standardised_square(residual, diagonal(0.5, 0.75), false, false).value, 9 / 1.5 + 1 / 1.75);
  const auto single = standardised_square(Eigen::VectorXd::Constant(1, 3), diagonal(0.5, 0), true, false);
  EXPECT_DOUBLE_EQ(single.value, 18);
  EXPECT_EQ(single.freedom, 1);
}

// What an observation alone determines is no test of it; the other direction is one where the observation can be
// spared.
TEST(StandardisedSquare, WhereADirectionHasNoRedundancy) {
  const Eigen::Vector2d residual(5, 3);
  EXPECT_EQ(standardised_square(residual, diagonal(1, 0.5), true, false).value, 0);
  const auto spared = standardised_square(residual, diagonal(1, 0.5), true, true);
  EXPECT_NEAR(spared.value, 18, 1e-9);
  EXPECT_EQ(spared.freedom, 1);
  // Whatever the direction's angle.
  const double angle = 0.7;
  Eigen::Matrix2d turn;
  turn << std::cos(angle), -std::sin(angle), std::sin(angle), std::cos(angle);
  const Eigen::Matrix2d hat = turn * diagonal(1, 0.5) * turn.transpose();
  EXPECT_NEAR(standardised_square(turn * residual, hat, true, true).value, 18, 1e-9);
  EXPECT_EQ(standardised_square(residual, diagonal(1, 1), true, true).value, 0);
  // One that was left out is tested against its prediction, which is only vague there.
  EXPECT_NEAR(standardised_square(residual, diagonal(1, 0.5), false, false).value, 25 / 2.0 + 9 / 1.5, 1e-12);
}

}  // namespace
}  // namespace crumple
