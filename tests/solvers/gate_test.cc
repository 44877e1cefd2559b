#include "solvers/gate.h"

#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "solvers/distribution_tails.h"

namespace crumple {
namespace {

Eigen::Matrix2d diagonal(double first, double second) { return Eigen::Vector2d(first, second).asDiagonal(); }

TEST(Gate, OneDimensionIsCutAsOftenAsTwo) {
  EXPECT_NEAR(gate_for(1, 16), 12.87, 0.01);
  std::mt19937_64 generator(1);
  std::normal_distribution<double> normal;
  for (const int d : {1, 2}) {
    const double gate = gate_for(d, 6);
    double sum = 0;
    int kept = 0;
    for (int i = 0; i < 200000; ++i) {
      double s = 0;
      for (int k = 0; k < d; ++k) s += std::pow(normal(generator), 2);
      if (s > gate) continue;
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

// Where the variance is an estimate the F distribution's tail is the normal one's; from many data they agree.
TEST(Gate, IsExceededAsOftenWhateverTellsTheVariance) {
  const double probability = std::exp(-8);
  for (const double freedom : {20.0, 100.0, 1e9}) {
    EXPECT_NEAR(f_tail(gate_for(2, 16, freedom) / 2, 2, freedom) / probability, 1, 1e-6) << freedom;
    EXPECT_NEAR(f_tail(gate_for(1, 16, freedom), 1, freedom) / probability, 1, 1e-6) << freedom;
  }
  EXPECT_GT(gate_for(2, 16, 100), 17);
  EXPECT_NEAR(gate_for(2, 16, 1e9), 16, 1e-6);
}

// Of numbers with a known mean: each by the variance of all, turned into each by the variance of the others.
TEST(Gate, AnObservationThatCountsIsTestedByTheOthersVariance) {
  const std::vector<double> values{0.3, -1.2, 2.5, 0.7, -0.4};
  double sum = 0;
  for (const double value : values) sum += value * value;
  for (const double value : values) {
    const double square = value * value;
    EXPECT_NEAR(without_itself(square / (sum / 5), square / (sum / 5), 1, 5), square / ((sum - square) / 4), 1e-12);
  }
  EXPECT_EQ(without_itself(5, 5, 1, 5), std::numeric_limits<double>::infinity());
  EXPECT_EQ(without_itself(7, 7, 2, std::numeric_limits<double>::infinity()), 7);
}

// The mean of eight points in the plane, those beyond the gate left out, scatters by that much more than the number of
// those that are left says.
TEST(Gate, CostsWhatItLeavesOutByChance) {
  constexpr double kGate = 9;
  constexpr int kPoints = 8, kDraws = 200000;
  std::mt19937_64 generator(2);
  std::normal_distribution<double> normal;
  double square = 0, stated = 0;
  for (int draw = 0; draw < kDraws; ++draw) {
    Eigen::Matrix2Xd points(2, kPoints);
    for (double& value : points.reshaped()) value = normal(generator);
    const Eigen::Vector2d mean = points.rowwise().mean();
    Eigen::Vector2d sum = Eigen::Vector2d::Zero();
    int left = 0;
    for (int i = 0; i < kPoints; ++i) {
      const auto tested =
          standardised_square(points.col(i) - mean, diagonal(1.0 / kPoints, 1.0 / kPoints), true, false);
      if (tested.value > gate_for(2, kGate)) continue;
      sum += points.col(i);
      ++left;
    }
    square += (sum / left).squaredNorm();
    stated += 2.0 / left;
  }
  const double cost = cost_of_gate(2, kGate) * kPoints / (kPoints - 1);
  EXPECT_NEAR(square / stated - 1, cost, 0.15 * cost);
  EXPECT_NEAR(cost_of_gate(2, 16), 8 * std::exp(-8), 1e-12);
  // Huber's variance of a mean that leaves out beyond t: int psi^2 over (int psi')^2, psi = x up to t.
  const double t = std::sqrt(gate_for(1, 16));
  const double inside = std::erf(t / std::sqrt(2)), density = std::exp(-t * t / 2) / std::sqrt(2 * M_PI);
  const double huber = (inside - 2 * t * density) / std::pow(inside - 2 * t * density, 2) * inside - 1;
  EXPECT_NEAR(cost_of_gate(1, 16), huber, 0.02 * huber);
}

}  // namespace
}  // namespace crumple
