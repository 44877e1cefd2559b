#include "solvers/distribution_tails.h"

#include <cmath>
#include <limits>
#include <random>

#include <gtest/gtest.h>

namespace crumple {
namespace {

// Table values, as any book of statistics has them.
TEST(ChiSquare, TailsOfTheTable) {
  EXPECT_NEAR(chi_square_tail(3.841459, 1), 0.05, 1e-7);
  EXPECT_NEAR(chi_square_tail(5.991465, 2), 0.05, 1e-7);
  EXPECT_NEAR(chi_square_tail(12.591587, 6), 0.05, 1e-7);
  EXPECT_NEAR(chi_square_tail(30.577914, 15), 0.01, 1e-7);
  EXPECT_NEAR(chi_square_tail(124.342113, 100), 0.05, 1e-7);
}

TEST(ChiSquare, NothingToTestIsNoEvidence) {
  EXPECT_EQ(chi_square_tail(7, 0), 1);
  EXPECT_EQ(chi_square_tail(0, 3), 1);
  EXPECT_GE(chi_square_tail(1e6, 5), 0);
}

TEST(ChiSquare, WhatIsExceededIsTheTailsInverse) {
  for (const int degrees : {1, 2, 7, 60}) {
    for (const double probability : {0.5, 0.05, 1e-5}) {
      EXPECT_NEAR(chi_square_tail(chi_square_exceeded(probability, degrees), degrees) / probability, 1, 1e-9);
    }
  }
}

TEST(F, TailsOfTheTable) {
  EXPECT_NEAR(f_tail(4.964603, 1, 10), 0.05, 1e-7);
  EXPECT_NEAR(f_tail(4.102821, 2, 10), 0.05, 1e-7);
  EXPECT_NEAR(f_tail(2.866081, 4, 20), 0.05, 1e-7);
}

// Of one error it is Student's t.
TEST(F, OfOneErrorIsStudents) { EXPECT_NEAR(f_tail(2.570582 * 2.570582, 1, 5), 0.05, 1e-7); }

TEST(F, WithAKnownVarianceIsChiSquare) {
  EXPECT_EQ(f_tail(12.591587 / 6, 6, std::numeric_limits<double>::infinity()), chi_square_tail(12.591587, 6));
  EXPECT_NEAR(f_tail(12.591587 / 6, 6, 1e9), 0.05, 1e-6);
  EXPECT_EQ(f_tail(0, 6, 10), 1);
  EXPECT_EQ(f_tail(1, 0, 10), 1);
}

// In one dimension: the shift of a normal variable that exceeds 1.96 either way with 80 % is 2.80 (Baarda 1968).
TEST(ChiSquare, NoncentralityThatIsSeen) {
  EXPECT_NEAR(noncentrality_seen(chi_square_exceeded(0.05, 1), 1, 0.8), 7.849, 1e-3);
  EXPECT_NEAR(noncentrality_seen(chi_square_exceeded(0.001, 1), 1, 0.8), 17.075, 1e-3);
  // Draws in three dimensions, of which 80 % have to be beyond.
  const double x = chi_square_exceeded(0.001, 3), shift = std::sqrt(noncentrality_seen(x, 3, 0.8));
  std::mt19937 random(3);
  std::normal_distribution<double> normal;
  constexpr int kDraws = 20000;
  int beyond = 0;
  for (int i = 0; i < kDraws; ++i) {
    const double a = normal(random) + shift, b = normal(random), c = normal(random);
    beyond += a * a + b * b + c * c > x ? 1 : 0;
  }
  EXPECT_NEAR(static_cast<double>(beyond) / kDraws, 0.8, 0.01);
}

}  // namespace
}  // namespace crumple
