#include "solvers/distribution_tails.h"

#include <cmath>
#include <limits>

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

}  // namespace
}  // namespace crumple
