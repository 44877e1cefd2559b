#include "solvers/chi_square.h"

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

}  // namespace
}  // namespace crumple
