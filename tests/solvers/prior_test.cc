#include "solvers/prior.h"

#include <cmath>

#include <Eigen/LU>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "solvers/bundle.h"
#include "tests/solvers/gradients.h"
#include "tests/solvers/synthetic.h"

namespace crumple {
namespace {

const BlockId kLens0{BlockId::Kind::lens, 0};
const BlockId kMount1{BlockId::Kind::mount, 1};
const BlockId kPlacement2{BlockId::Kind::placement, 2};

CalibrationState truth() { return make_synthetic({}).truth; }

// The state with the prior's three blocks moved by one joint tangent step.
CalibrationState moved(CalibrationState state, const Eigen::VectorXd& step) {
  Lens& lens = state.rig.sensors[0].lens;
  std::vector<double> parameters = lens.parameters();
  for (std::size_t i = 0; i < parameters.size(); ++i) parameters[i] += step[static_cast<Eigen::Index>(i)];
  lens = lens.with_parameters(parameters);
  Pose& mount = state.rig.sensors[1].sensor_from_mount;
  mount = retract(mount, step.segment<6>(9));
  state.world_from_board[2] = retract(state.world_from_board[2], step.segment<6>(15));
  return state;
}

TEST(Prior, JacobianMatchesDifferencesFarFromWhatItIsAbout) {
  Eigen::MatrixXd root = Eigen::MatrixXd::Random(5, 5) + 3 * Eigen::MatrixXd::Identity(5, 5);
  const Prior prior =
      Prior::create("some", {{kMount1, 0}, {kLens0, 4}, {kPlacement2, 2}, {kMount1, 4}, {kPlacement2, 1}}, truth(),
                    root * root.transpose())
          .value();
  EXPECT_THAT(prior.blocks(), testing::ElementsAre(kMount1, kLens0, kPlacement2));
  Eigen::VectorXd far = Eigen::VectorXd::LinSpaced(21, -0.9, 0.7);
  const CalibrationState state = moved(truth(), far);
  const auto residuals = [&](const Eigen::VectorXd& step) { return prior.evaluate(moved(state, step)).residuals; };
  const Eigen::MatrixXd numeric = fourth_order_differences(residuals, Eigen::VectorXd::Zero(21), 1e-3);
  const std::vector<RowMajorMatrix> analytic = prior.evaluate(state).jacobians;
  EXPECT_LT((numeric.middleCols(9, 6) - analytic[0]).cwiseAbs().maxCoeff(), 1e-10);
  EXPECT_LT((numeric.leftCols(9) - analytic[1]).cwiseAbs().maxCoeff(), 1e-10);
  EXPECT_LT((numeric.rightCols(6) - analytic[2]).cwiseAbs().maxCoeff(), 1e-10);
}

TEST(Prior, WhitensByItsCovariance) {
  Eigen::Matrix2d covariance;
  covariance << 4, 1, 1, 9;
  const Prior prior = Prior::create("some", {{kLens0, 0}, {kLens0, 2}}, truth(), covariance).value();
  Eigen::VectorXd step = Eigen::VectorXd::Zero(21);
  step[0] = 3;
  step[2] = -2;
  const Eigen::Vector2d difference(3, -2);
  EXPECT_NEAR(prior.evaluate(moved(truth(), step)).residuals.squaredNorm(),
              difference.dot(covariance.inverse() * difference), 1e-12);
}

TEST(Prior, RefusesWhatIsNoCovariance) {
  Eigen::Matrix2d indefinite;
  indefinite << 1, 2, 2, 1;
  EXPECT_FALSE(Prior::create("some", {{kLens0, 0}, {kLens0, 1}}, truth(), indefinite));
  EXPECT_FALSE(Prior::create("some", {{kLens0, 0}, {kLens0, 0}}, truth(), Eigen::Matrix2d::Identity()));
  EXPECT_FALSE(Prior::create("some", {{kLens0, 0}}, truth(), Eigen::MatrixXd::Constant(1, 1, NAN)));
}

// With one parameter's prior added, C' = C - c c' / (sigma^2 + C_ii) and the estimate moves by c / (sigma^2 + C_ii).
TEST(Prior, CountsAsOneObservationInSolveAndCovariance) {
  const Synthetic made = make_synthetic({.corner_sigma_px = 0.1, .stripe_sigma_px = 0.1, .feature_sigma_px = 0.1});
  BundleOptions options{.reject_outliers = false, .minimum_redundancy = 1e9};  // sigma as given, so that it stays
  options.prior_sigma_px = 0.1;
  const auto free = refine(made.truth, made.observations, options);
  ASSERT_TRUE(free) << free.error().message;
  const Eigen::MatrixXd& before = free->covariance.common();
  const double sigma = std::sqrt(before(0, 0)), about = free->state.rig.sensors[0].lens.parameters()[0] + 3 * sigma;
  CalibrationState belief = made.truth;
  std::vector<double> parameters = belief.rig.sensors[0].lens.parameters();
  parameters[0] = about;
  belief.rig.sensors[0].lens = belief.rig.sensors[0].lens.with_parameters(parameters);
  options.priors = {Prior::create("fx", {{kLens0, 0}}, belief, Eigen::MatrixXd::Constant(1, 1, sigma * sigma)).value()};
  const auto held = refine(made.truth, made.observations, options);
  ASSERT_TRUE(held) << held.error().message;
  const Eigen::MatrixXd expected = before - before.col(0) * before.row(0) / (2 * before(0, 0));
  const Eigen::VectorXd scale = before.diagonal().cwiseSqrt().cwiseInverse();
  EXPECT_LT((scale.asDiagonal() * (held->covariance.common() - expected) * scale.asDiagonal()).cwiseAbs().maxCoeff(),
            1e-2);
  EXPECT_NEAR((held->state.rig.sensors[0].lens.parameters()[0] - about) / sigma, -1.5, 0.02);
  EXPECT_THAT(held->undetermined, testing::IsEmpty());
}

TEST(Undetermined, NamesTheTermsThatOnlyAWeakPriorDecides) {
  Synthetic made = make_synthetic({.placements = 10, .corner_sigma_px = 0.1, .model = "LENSMODEL_OPENCV8"});
  made.observations.stripes.clear();
  made.observations.features.clear();
  const Eigen::Vector3d sigma(5, 20, 100);
  const Prior prior =
      Prior::create("cam0.weak", {{kLens0, 9}, {kLens0, 10}, {kLens0, 11}}, made.truth, sigma.cwiseAbs2().asDiagonal())
          .value();
  const auto known = refine(made.truth, made.observations, {.priors = {prior}});
  ASSERT_TRUE(known) << known.error().message;
  EXPECT_THAT(known->undetermined, testing::IsEmpty());
  const auto held = refine(made.truth, made.observations, {.priors = {prior.as_weak()}});
  ASSERT_TRUE(held) << held.error().message;
  ASSERT_THAT(held->undetermined, testing::Not(testing::IsEmpty()));
  EXPECT_GT(held->undetermined[0].prior_share, 0.9);
  std::vector<std::string> terms, partners;
  for (const Undetermined& undetermined : held->undetermined) {
    terms.insert(terms.end(), undetermined.terms.begin(), undetermined.terms.end());
    partners.insert(partners.end(), undetermined.partners.begin(), undetermined.partners.end());
  }
  EXPECT_THAT(terms, testing::IsSupersetOf({"cam0.k4", "cam0.k5", "cam0.k6"}));
  EXPECT_THAT(partners, testing::Contains(testing::AnyOf("cam0.k1", "cam0.k2", "cam0.k3")));
  EXPECT_EQ(known->covariance.common(), held->covariance.common());
}

}  // namespace
}  // namespace crumple
