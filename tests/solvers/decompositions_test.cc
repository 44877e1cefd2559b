#include "solvers/decompositions.h"

#include <cmath>
#include <random>

#include <gtest/gtest.h>

namespace crumple {
namespace {

Eigen::MatrixXd random_positive(Eigen::Index size, std::mt19937& random) {
  std::normal_distribution<double> normal;
  const Eigen::MatrixXd root = Eigen::MatrixXd::NullaryExpr(size, size, [&] { return normal(random); });
  return root * root.transpose();
}

void expect_dominant(const Eigen::MatrixXd& matrix) {
  const DominantEigen found = dominant_eigen(matrix);
  const SymmetricEigen all = symmetric_eigen(matrix);
  const double largest = all.values.tail<1>()[0];
  EXPECT_NEAR(found.value, largest, 0.02 * largest);
  EXPECT_NEAR(found.vector.norm(), 1, 1e-12);
  EXPECT_LT((matrix * found.vector - found.value * found.vector).norm(), 0.02 * largest);
}

TEST(DominantEigen, IsTheLargest) {
  std::mt19937 random(1);
  for (const Eigen::Index size : {1, 2, 7, 60}) expect_dominant(random_positive(size, random));
}

// A variable that nothing is coupled to must not hold the iteration in its block, however wide its diagonal is.
TEST(DominantEigen, IsFoundBesideUncoupledVariables) {
  Eigen::MatrixXd matrix = Eigen::MatrixXd::Zero(23, 23);
  matrix.topLeftCorner<2, 2>() << 50, 49, 49, 50;
  matrix(2, 2) = 90;
  matrix.bottomRightCorner<20, 20>().setConstant(10);
  matrix.bottomRightCorner<20, 20>().diagonal().setConstant(12);
  expect_dominant(matrix);
  EXPECT_NEAR(dominant_eigen(matrix).value, 202, 4);
}

TEST(DominantEigen, OfAUnitDiagonalIsNotThatOfItsFirstColumn) {
  Eigen::MatrixXd matrix = Eigen::MatrixXd::Identity(41, 41);
  matrix.bottomRightCorner<40, 40>().setConstant(0.5);
  matrix.diagonal().setOnes();
  EXPECT_NEAR(dominant_eigen(matrix).value, 20.5, 0.3);
}

}  // namespace
}  // namespace crumple
