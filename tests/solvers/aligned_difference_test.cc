#include "solvers/aligned_difference.h"

#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include "solvers/small_motion.h"
#include "tests/solvers/gradients.h"

namespace crumple {
namespace {

class Normal {
 public:
  Eigen::MatrixXd operator()(Eigen::Index rows, Eigen::Index columns) {
    return Eigen::MatrixXd::NullaryExpr(rows, columns, [&] { return normal_(generator_); });
  }

 private:
  std::mt19937_64 generator_{5};
  std::normal_distribution<double> normal_;
};

TEST(AlignedDifference, IsChiSquareWhereNothingButNoiseDiffers) {
  constexpr int kTurns = 400, kPoints = 30, kUncertain = 9;
  Normal normal;
  Differences d{
      .values = {}, .by_frame = normal(2 * kPoints, 6), .root = normal(2 * kPoints, kUncertain), .floor = 1e-6};
  double statistic = 0;
  int beyond = 0;
  for (int turn = 0; turn < kTurns; ++turn) {
    d.values = d.root * normal(kUncertain, 1) + d.by_frame * normal(6, 1);
    const AlignedDifference aligned = aligned_difference(d);
    ASSERT_EQ(aligned.degrees, kUncertain);
    EXPECT_LT(aligned.unexplained, 1e-6);
    statistic += aligned.statistic;
    beyond += aligned.probability < 0.1;
  }
  EXPECT_NEAR(statistic / (kTurns * kUncertain), 1, 4 * std::sqrt(2.0 / (kTurns * kUncertain)));
  EXPECT_NEAR(beyond, 0.1 * kTurns, 4 * std::sqrt(0.09 * kTurns));
}

TEST(AlignedDifference, DoesNotSeeMotionsOfTheFrame) {
  Normal normal;
  Differences d{
      .dimension = 3, .values = normal(60, 1), .by_frame = normal(60, 6), .root = normal(60, 4), .floor = 1e-3};
  const AlignedDifference before = aligned_difference(d);
  const Eigen::VectorXd motion = 10 * normal(6, 1);
  d.values += d.by_frame * motion;
  const AlignedDifference after = aligned_difference(d);
  EXPECT_LT((after.values - before.values).norm(), 1e-9);
  EXPECT_LT((after.motion - before.motion - motion).norm(), 1e-9);
  EXPECT_NEAR(after.statistic, before.statistic, 1e-6 * before.statistic);
}

TEST(AlignedDifference, TellsApartWhatNoUncertaintyExplains) {
  Differences d{.values = Eigen::VectorXd::Zero(8),
                .by_frame = Eigen::MatrixXd(8, 0),
                .root = Eigen::MatrixXd::Zero(8, 1),
                .floor = 1e-3};
  d.root(0, 0) = 0.5;
  d.values[0] = 1;
  d.values[5] = 3;
  const AlignedDifference aligned = aligned_difference(d);
  EXPECT_NEAR(aligned.statistic, 4, 1e-4);
  EXPECT_EQ(aligned.degrees, 1);
  EXPECT_NEAR(aligned.unexplained, 1.5, 1e-9);
  EXPECT_NEAR(aligned.rms(), std::sqrt(10 / 4.0), 1e-12);
  EXPECT_NEAR(aligned.expected_rms(), 0.25, 1e-12);
}

// Differences below the floor count as none, however certain they are.
TEST(AlignedDifference, FindsNothingBelowTheFloor) {
  Normal normal;
  Differences d{.values = {}, .by_frame = Eigen::MatrixXd(40, 0), .root = 1e-9 * normal(40, 3), .floor = 1e-3};
  d.values = 1e5 * (d.root * normal(3, 1));
  const AlignedDifference aligned = aligned_difference(d);
  EXPECT_LT(aligned.rms(), 1e-3);
  EXPECT_EQ(aligned.probability, 1);
}

TEST(OutsideProbability, IsTheNormalDistributions) {
  EXPECT_NEAR(outside_probability(1), 0.3173105079, 1e-9);
  EXPECT_NEAR(outside_probability(2), 0.0455002639, 1e-9);
}

TEST(CovarianceRoot, MakesTheCovarianceOfHeldAndVerySmallRows) {
  Normal normal;
  Eigen::MatrixXd root = normal(5, 5);
  root.row(1) *= 1e-6;
  root.row(3) *= 1e3;
  root.row(4).setZero();
  const Eigen::MatrixXd covariance = root * root.transpose(), found = covariance_root(covariance);
  const Eigen::VectorXd scale = (covariance.diagonal().array() + 1e-300).sqrt().inverse();
  EXPECT_LT((scale.asDiagonal() * (found * found.transpose() - covariance) * scale.asDiagonal()).cwiseAbs().maxCoeff(),
            1e-12);
}

TEST(SmallMotion, OfAPoseMovesWhatItCarries) {
  const Pose pose = retract({}, (Vector6d() << 0.3, -0.2, 0.9, 100, -50, 700).finished());
  const Eigen::Vector3d carried(30, 40, -20);
  const auto place = [&](const Eigen::VectorXd& step) { return Eigen::Vector3d(retract(pose, step) * carried); };
  const Eigen::MatrixXd expected = central_differences(place, Eigen::VectorXd::Zero(6));
  EXPECT_LT((d_points_d_motion({pose * carried}) * d_motion_d_pose(pose) - expected).cwiseAbs().maxCoeff(), 1e-5);
}

TEST(SmallMotion, FollowsFromDisplacedPoints) {
  const std::vector<Eigen::Vector3d> points{{800, 10, 2000}, {700, 80, 2100}, {820, -60, 1950}, {760, 5, 2050}};
  const Vector6d motion = (Vector6d() << 1e-3, -2e-3, 5e-4, 0.3, -0.1, 0.2).finished();
  const Eigen::VectorXd moved = d_points_d_motion(points) * motion;
  EXPECT_LT((d_motion_d_points(points) * moved - motion).norm(), 1e-10);
  EXPECT_FALSE(span_a_frame({{0, 0, 0}, {1, 1, 1}, {5, 5, 5}}));
  EXPECT_FALSE(span_a_frame({{0, 0, 0}, {1, 0, 0}}));
  EXPECT_TRUE(span_a_frame({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}));
}

}  // namespace
}  // namespace crumple
