#include "solvers/pose.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include "tests/solvers/gradients.h"

namespace crumple {
namespace {

Vector6d arbitrary_step() {
  Vector6d v;
  for (int i = 0; i < 6; ++i) v[i] = *rc::gen::inRange(-1000, 1001) * (i < 3 ? 1e-3 : 1.0);
  return v;
}

RC_GTEST_PROP(Pose, InverseUndoesIt, ()) {
  const Pose pose = retract({}, arbitrary_step());
  const Eigen::Vector3d x(12, -7, 450);
  RC_ASSERT((pose.inverse() * (pose * x) - x).norm() < 1e-10);
}

RC_GTEST_PROP(Pose, CompositionAppliesTheRightOneFirst, ()) {
  const Pose b_from_a = retract({}, arbitrary_step());
  const Pose c_from_b = retract({}, arbitrary_step());
  const Eigen::Vector3d x(1, 2, 3);
  RC_ASSERT(((c_from_b * b_from_a) * x - c_from_b * (b_from_a * x)).norm() < 1e-9);
}

RC_GTEST_PROP(Pose, LocalStepLeadsFromOneToTheOther, ()) {
  const Pose from = retract({}, arbitrary_step());
  const Vector6d step = arbitrary_step();
  RC_ASSERT((local_step(from, retract(from, step)) - step).norm() < 1e-9);
}

TEST(Pose, SmallRotationVectorsSurvive) {
  for (const double angle : {0.0, 1e-12, 1e-9, 1e-5, 1e-3, 3.14}) {
    const Eigen::Vector3d v = angle * Eigen::Vector3d(1, -2, 2) / 3;
    EXPECT_LT((rotation_vector(rotation_from_vector(v)) - v).norm(), 1e-15 + 1e-14 * angle) << angle;
  }
}

TEST(Pose, DerivativeMatchesCentralDifferences) {
  const Pose pose = retract({}, (Vector6d() << 0.3, -1.2, 0.7, 10, -20, 500).finished());
  const Eigen::Vector3d x(30, 40, -5);
  const auto moved = [&](const Eigen::VectorXd& step) { return Eigen::VectorXd(retract(pose, step) * x); };
  const Eigen::MatrixXd numeric = central_differences(moved, Eigen::VectorXd::Zero(6));
  EXPECT_LT((numeric - d_transformed_d_pose(pose, x)).norm(), 1e-6);
}

TEST(Pose, CompositionDerivativeMatchesCentralDifferences) {
  const Pose left = retract({}, (Vector6d() << 0.3, -1.2, 0.7, 10, -20, 500).finished());
  const Pose right = retract({}, (Vector6d() << -0.5, 0.2, 0.9, 100, 40, -30).finished());
  const CompositionDerivative d = d_composed(left, right);
  const auto of_left = [&](const Eigen::VectorXd& step) {
    return Eigen::VectorXd(local_step(left * right, retract(left, step) * right));
  };
  const auto of_right = [&](const Eigen::VectorXd& step) {
    return Eigen::VectorXd(local_step(left * right, left * retract(right, step)));
  };
  EXPECT_LT((central_differences(of_left, Eigen::VectorXd::Zero(6)) - d.d_left).norm(), 1e-6);
  EXPECT_LT((central_differences(of_right, Eigen::VectorXd::Zero(6)) - d.d_right).norm(), 1e-6);
}

TEST(Pose, NearestRotationIsProper) {
  const Eigen::Matrix3d mirror = Eigen::Vector3d(1, 1, -1.1).asDiagonal();
  EXPECT_NEAR(nearest_rotation(mirror).determinant(), 1, 1e-12);
  const Eigen::Matrix3d rotation = rotation_from_vector({0.1, 0.2, 0.3}).toRotationMatrix();
  EXPECT_LT((nearest_rotation(2.5 * rotation) - rotation).norm(), 1e-12);
}

TEST(Pose, LeftJacobianTellsHowExpTurns) {
  for (const double angle : {0.0, 1e-6, 5e-3, 0.02, 1.0, 3.0}) {
    const Eigen::Vector3d v = angle * Eigen::Vector3d(0.6, -0.48, 0.64);
    for (int axis = 0; axis < 3; ++axis) {
      const double h = 1e-6;
      const Eigen::Vector3d step = h * Eigen::Vector3d::Unit(axis);
      const Eigen::Vector3d turn =
          rotation_vector(rotation_from_vector(v + step) * rotation_from_vector(v - step).conjugate()) / (2 * h);
      EXPECT_LT((turn - left_jacobian(v).col(axis)).norm(), 1e-8) << angle;
    }
    EXPECT_LT((left_jacobian(v) * inverse_left_jacobian(v) - Eigen::Matrix3d::Identity()).norm(), 1e-9) << angle;
  }
}

}  // namespace
}  // namespace crumple
