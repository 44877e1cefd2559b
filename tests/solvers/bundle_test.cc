#include "solvers/bundle.h"

#include <cmath>
#include <random>

#include <ceres/ceres.h>
#include <gtest/gtest.h>

#include "solvers/weights.h"
#include "tests/solvers/synthetic.h"

namespace crumple {
namespace {

std::vector<double> all_parameters(const CalibrationState& state) {
  std::vector<double> values;
  for (const Sensor& sensor : state.rig.sensors) {
    values.insert(values.end(), sensor.lens.parameters().begin(), sensor.lens.parameters().end());
  }
  for (const double t : state.rig.sensors[1].sensor_from_mount.translation) values.push_back(t);
  return values;
}

const GroupSummary& group(const BundleResult& result, View::Kind kind) {
  for (const GroupSummary& g : result.groups) {
    if (g.kind == kind) return g;
  }
  throw std::logic_error("no such group");
}

TEST(Bundle, RecoversNoiseFreeTruth) {
  const Synthetic made = make_synthetic({.warp_mm = {0.6, -0.4}});
  const auto result = refine(disturbed(made.truth, 3), made.observations, {.estimate_warp = true});
  ASSERT_TRUE(result) << result.error().message;
  const std::vector<double> found = all_parameters(result->state), truth = all_parameters(made.truth);
  for (std::size_t i = 0; i < truth.size(); ++i) {
    EXPECT_NEAR(found[i], truth[i], 1e-6 * std::max(1.0, std::abs(truth[i]))) << i;
  }
  EXPECT_NEAR(result->state.boards[0].warp_mm.x(), 0.6, 1e-6);
  EXPECT_NEAR(result->state.boards[0].warp_mm.y(), -0.4, 1e-6);
}

TEST(Bundle, EstimatesTheNoiseOfEachGroup) {
  const Synthetic made = make_synthetic(
      {.placements = 12, .corner_sigma_px = 0.2, .stripe_sigma_px = 0.05, .feature_sigma_px = 0.4, .seed = 7});
  const auto result = refine(disturbed(made.truth, 3), made.observations, {});
  ASSERT_TRUE(result) << result.error().message;
  // The relative error of an estimated sigma is 1 / sqrt(2 redundancy): some 2 % here.
  EXPECT_NEAR(group(*result, View::Kind::corners).sigma_px, 0.2, 0.2 * 0.07);
  EXPECT_NEAR(group(*result, View::Kind::stripes).sigma_px, 0.05, 0.05 * 0.07);
  EXPECT_NEAR(group(*result, View::Kind::features).sigma_px, 0.4, 0.4 * 0.07);
}

TEST(Bundle, LeavesOutGrossErrorsAndHardlyAnyGoodObservation) {
  Synthetic made = make_synthetic({.placements = 10, .corner_sigma_px = 0.2, .stripe_sigma_px = 0.05, .seed = 4});
  made.observations.features.clear();
  std::size_t planted = 0;
  for (StripeView& view : made.observations.stripes) {
    for (std::size_t i = 0; i < view.coordinates_px.size(); i += 8, ++planted) {
      view.coordinates_px[i] += i % 16 == 0 ? 3 : -20;
    }
  }
  const auto result = refine(disturbed(made.truth, 3), made.observations, {});
  ASSERT_TRUE(result) << result.error().message;
  const GroupSummary& stripes = group(*result, View::Kind::stripes);
  EXPECT_GE(stripes.outliers, planted);
  EXPECT_LE(stripes.outliers, planted + 5);
  EXPECT_NEAR(stripes.sigma_px, 0.05, 0.05 * 0.07);
}

// Corners on the very edge of what a folding lens can image: noise puts some of them past it, where it may not stay.
TEST(Bundle, ObservationsAtALensesFoldStayWithinIt) {
  const Lens lens = Lens::create("LENSMODEL_OPENCV4", {1024, 768}, {500, 500, 512, 384, -1, 0, 0, 0}).value();
  const double fold = lens.domain().largest_slope();
  CalibrationState truth;
  truth.rig.sensors = {{"cam0", SensorKind::camera, lens, {}}};
  truth.boards = {Board::grid(9, 7, 10)};
  Observations observations;
  observations.placement_count = 8;
  std::mt19937_64 generator(2);
  std::normal_distribution<double> noise_px(0, 0.5);
  for (std::size_t p = 0; p < observations.placement_count; ++p) {
    const Eigen::Quaterniond turn = rotation_from_vector({0, 0, 0.8 * static_cast<double>(p)});
    const Eigen::Quaterniond tilt = rotation_from_vector({p % 2 == 0 ? 0.5 : -0.4, p % 3 == 0 ? 0.4 : -0.3, 0});
    truth.world_from_board.push_back({turn * tilt, turn * Eigen::Vector3d(fold * 400 - 60, -30, 400)});
    truth.board_of.push_back(0);
    CornerView view{0, p, {}, {}};
    for (int i = 0; i < truth.boards[0].point_count(); ++i) {
      const auto pixel = lens.project(truth.world_from_board.back() * truth.boards[0].point(i));
      if (!pixel) continue;
      const double x_px = noise_px(generator);
      view.corners.push_back(i);
      view.pixels.push_back(*pixel + Eigen::Vector2d(x_px, noise_px(generator)));
    }
    observations.corners.push_back(view);
  }
  const auto result = refine(truth, observations, {});
  ASSERT_TRUE(result) << result.error().message;
  const Lens& found = result->state.rig.sensors[0].lens;
  EXPECT_NEAR(found.domain().largest_slope(), fold, 0.02);
  for (const CornerView& view : observations.corners) {
    for (const int corner : view.corners) {
      EXPECT_TRUE(found.project(result->state.world_from_board[view.placement] * result->state.boards[0].point(corner)))
          << view.placement << " " << corner;
    }
  }
}

TEST(Bundle, ASmallGroupKeepsItsPriorSigma) {
  Synthetic made = make_synthetic({.corner_sigma_px = 0.1, .feature_sigma_px = 0.2});
  made.observations.stripes.clear();
  FeatureView few = made.observations.features.front();
  few.camera_pixels.resize(25);
  few.projector_pixels.resize(25);
  made.observations.features = {few};
  const auto result = refine(made.truth, made.observations, {.held = {{BlockId::Kind::lens, 1}}});
  ASSERT_TRUE(result) << result.error().message;
  EXPECT_FALSE(group(*result, View::Kind::features).sigma_estimated);
  EXPECT_EQ(group(*result, View::Kind::features).sigma_px, 0.3);
}

TEST(Bundle, SameBitsAtAnyThreadCount) {
  const Synthetic made = make_synthetic({.corner_sigma_px = 0.2, .stripe_sigma_px = 0.1, .feature_sigma_px = 0.2});
  const CalibrationState start = disturbed(made.truth, 3);
  const auto one = refine(start, made.observations, {.threads = 1});
  const auto three = refine(start, made.observations, {.threads = 3});
  ASSERT_TRUE(one && three);
  EXPECT_EQ(all_parameters(one->state), all_parameters(three->state));
  EXPECT_TRUE(one->covariance.common() == three->covariance.common());
}

// The same Jacobian through ceres::Covariance, everything in one dense block.
class WholeJacobian final : public ceres::CostFunction {
 public:
  explicit WholeJacobian(RowMajorMatrix jacobian) : jacobian_(std::move(jacobian)) {
    set_num_residuals(static_cast<int>(jacobian_.rows()));
    mutable_parameter_block_sizes()->push_back(static_cast<int>(jacobian_.cols()));
  }
  bool Evaluate(const double* const*, double* residuals, double** jacobians) const override {
    std::fill(residuals, residuals + num_residuals(), 0.0);
    if (jacobians && jacobians[0]) std::copy(jacobian_.data(), jacobian_.data() + jacobian_.size(), jacobians[0]);
    return true;
  }

 private:
  RowMajorMatrix jacobian_;
};

TEST(Covariance, EqualsCeresCovariance) {
  const Synthetic made = make_synthetic({.placements = 6, .corner_sigma_px = 0.2, .stripe_sigma_px = 0.05});
  const CalibrationState& state = made.truth;
  const auto views = make_views(made.observations, made.truth.board_of);
  const Parameters parameters(state, views, {{BlockId::Kind::mount, 0}, {BlockId::Kind::scale, 0}});
  NormalEquations equations(parameters);
  std::vector<RowMajorMatrix> rows;
  for (const auto& view : views) {
    ViewEvaluation evaluation;
    ASSERT_TRUE(view->evaluate(state, true, evaluation));
    whiten(*view, {0.1, 1, std::vector<char>(static_cast<std::size_t>(view->size()), 1)}, evaluation);
    equations.add(*view, evaluation);
    RowMajorMatrix row = RowMajorMatrix::Zero(evaluation.residuals.size(), parameters.size());
    for (std::size_t b = 0; b < view->blocks().size(); ++b) {
      const BlockId block = view->blocks()[b];
      const auto offset = block.kind == BlockId::Kind::placement
                              ? std::optional<int>(parameters.common_size() + 6 * static_cast<int>(block.index))
                              : parameters.common_offset(block);
      if (!offset) continue;
      row.middleCols(*offset, tangent_size(block, state)) = block_jacobian(*view, evaluation, state, b);
    }
    rows.push_back(row);
  }
  RowMajorMatrix whole(0, parameters.size());
  for (const RowMajorMatrix& row : rows) {
    whole.conservativeResize(whole.rows() + row.rows(), Eigen::NoChange);
    whole.bottomRows(row.rows()) = row;
  }
  std::vector<double> x(static_cast<std::size_t>(parameters.size()), 0.0);
  ceres::Problem problem;
  problem.AddResidualBlock(new WholeJacobian(whole), nullptr, x.data());
  ceres::Covariance::Options options;
  options.algorithm_type = ceres::DENSE_SVD;
  ceres::Covariance oracle(options);
  ASSERT_TRUE(oracle.Compute(std::vector<std::pair<const double*, const double*>>{{x.data(), x.data()}}, &problem));
  RowMajorMatrix expected(parameters.size(), parameters.size());
  ASSERT_TRUE(oracle.GetCovarianceBlock(x.data(), x.data(), expected.data()));

  const auto covariance = JointCovariance::create(equations, state);
  ASSERT_TRUE(covariance) << covariance.error().message;
  const int n = parameters.common_size();
  const Eigen::VectorXd scale = expected.diagonal().cwiseSqrt().cwiseInverse();
  const Eigen::MatrixXd difference =
      scale.head(n).asDiagonal() * (covariance->common() - expected.topLeftCorner(n, n)) * scale.head(n).asDiagonal();
  EXPECT_LT(difference.cwiseAbs().maxCoeff(), 1e-7);

  const std::vector<BlockId> blocks{{BlockId::Kind::lens, 1}, {BlockId::Kind::placement, 4}};
  const Eigen::MatrixXd joint = covariance->of(blocks, state);
  const int lens = *parameters.common_offset(blocks[0]), placement = n + 24;
  EXPECT_LT((joint.topRightCorner(9, 6) - expected.block(lens, placement, 9, 6)).norm(),
            1e-6 * expected.block(lens, placement, 9, 6).norm());
  EXPECT_LT((joint.bottomRightCorner(6, 6) - expected.block(placement, placement, 6, 6)).norm(),
            1e-6 * expected.block(placement, placement, 6, 6).norm());
}

TEST(Covariance, NamesWhatIsNotDetermined) {
  SyntheticOptions options{.placements = 1, .corner_sigma_px = 0.1};
  Synthetic made = make_synthetic(options);
  made.observations.stripes.clear();
  made.observations.features.clear();
  const auto result = refine(made.truth, made.observations, {});
  ASSERT_FALSE(result);
  EXPECT_NE(result.error().message.find("cam0."), std::string::npos) << result.error().message;
}

}  // namespace
}  // namespace crumple
