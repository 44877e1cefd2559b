#include "solvers/bundle.h"

#include <algorithm>
#include <cmath>
#include <random>

#include <Eigen/LU>
#include <ceres/ceres.h>
#include <gtest/gtest.h>

#include "solvers/decompositions.h"
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

// What a view's observations were standardised to, the largest first, with the numbers of the observations.
std::vector<std::pair<float, std::size_t>> largest_standardised(const ViewSummary& view) {
  std::vector<std::pair<float, std::size_t>> all;
  for (std::size_t i = 0; i < view.standardised.size(); ++i) all.emplace_back(view.standardised[i], i);
  std::sort(all.rbegin(), all.rend());
  return all;
}

TEST(Bundle, RedundanciesMakeUpTheirGroups) {
  Synthetic made = make_synthetic(
      {.placements = 10, .corner_sigma_px = 0.2, .stripe_sigma_px = 0.05, .feature_sigma_px = 0.4, .seed = 4});
  made.observations.corners[2].pixels[30].x() += 20;
  const auto result = refine(disturbed(made.truth, 3), made.observations, {});
  ASSERT_TRUE(result) << result.error().message;
  ASSERT_TRUE(result->settled);
  double all = 0;
  std::size_t rows = 0;
  for (const GroupSummary& g : result->groups) {
    double sum = 0;
    for (const ViewSummary& view : result->views) {
      if (view.kind != g.kind || view.sensor != g.sensor) continue;
      const auto d = static_cast<float>(View::dimension_of(view.kind));
      ASSERT_EQ(view.redundancy.size(), view.inlier.size());
      ASSERT_EQ(view.standardised.size(), view.inlier.size());
      for (std::size_t i = 0; i < view.inlier.size(); ++i) {
        if (view.inlier[i] == 0) {
          EXPECT_TRUE(std::isnan(view.redundancy[i]));
          continue;
        }
        EXPECT_GE(view.redundancy[i], 0);
        EXPECT_LE(view.redundancy[i], d);
        EXPECT_LE(view.standardised[i], g.standardised_limit * (1 + 1e-5));
        sum += view.redundancy[i];
        rows += static_cast<std::size_t>(d);
      }
    }
    EXPECT_NEAR(sum, g.redundancy, 1e-5 * g.redundancy);
    all += sum;
  }
  // All take together what the parameters are: nothing but observations tells them.
  EXPECT_NEAR(all, static_cast<double>(rows) - result->covariance.parameters().size(), 1e-3);
  EXPECT_EQ(result->views[2].inlier[30], 0);
}

// Whether it is left out or stays in, and is then in the sigma that it is held against.
TEST(Bundle, AGrossErrorIsTheLeastLikelyOfItsGroup) {
  Synthetic made = make_synthetic({.placements = 10, .corner_sigma_px = 0.2, .stripe_sigma_px = 0.05, .seed = 4});
  made.observations.features.clear();
  made.observations.corners[2].pixels[30] += Eigen::Vector2d(1.6, -1.2);  // ten sigma
  made.observations.stripes[5].coordinates_px[11] += 0.5;
  for (const bool reject : {true, false}) {
    const auto result = refine(disturbed(made.truth, 3), made.observations, {.reject_outliers = reject});
    ASSERT_TRUE(result) << result.error().message;
    for (const auto& [v, i] :
         {std::pair{std::size_t{2}, std::size_t{30}}, std::pair{std::size_t{15}, std::size_t{11}}}) {
      const ViewSummary& view = result->views[v];
      EXPECT_EQ(view.inlier[i] != 0, !reject);
      float largest = 0;
      for (const ViewSummary& other : result->views) {
        if (other.kind == view.kind && &other != &view) {
          largest = std::max(largest, largest_standardised(other)[0].first);
        }
      }
      const auto own = largest_standardised(view);
      EXPECT_EQ(own[0].second, i);
      EXPECT_GT(own[0].first, 1.5F * std::max(largest, own[1].first));
      EXPECT_GT(own[0].first, group(*result, view.kind).standardised_limit);
    }
  }
}

// Against I - J (J'J)^-1 J' of the whole Jacobian, with sigmas that are told.
TEST(Bundle, TestsAreWhatTheWholeJacobianSays) {
  Synthetic made = make_synthetic({.placements = 6, .corner_sigma_px = 0.2, .stripe_sigma_px = 0.05});
  made.observations.features.clear();
  constexpr double kInflation = 2;
  const BundleOptions options{.reject_outliers = false,
                              .known_sigma_px = {{"cam0.corners", 0.2}, {"proj0.stripes", 0.05}},
                              .estimate_known_sigmas = false,
                              .corner_inflation = kInflation};
  const auto result = refine(disturbed(made.truth, 3), made.observations, options);
  ASSERT_TRUE(result) << result.error().message;
  const auto views = make_views(made.observations, made.truth.board_of);
  const Parameters& parameters = result->covariance.parameters();
  RowMajorMatrix whole(0, parameters.size());
  for (const auto& view : views) {
    ViewEvaluation at;
    ASSERT_TRUE(view->evaluate(result->state, true, at));
    const bool corners = view->kind() == View::Kind::corners;
    RowMajorMatrix rows = RowMajorMatrix::Zero(at.residuals.size(), parameters.size());
    for (std::size_t b = 0; b < view->blocks().size(); ++b) {
      const BlockId block = view->blocks()[b];
      const auto slot = parameters.slot(block);
      const auto offset = slot ? std::optional<int>(parameters.common_size() + 6 * static_cast<int>(*slot))
                               : parameters.common_offset(block);
      if (!offset) continue;
      rows.middleCols(*offset, tangent_size(block, result->state)) +=
          block_jacobian(*view, at, result->state, b) / (corners ? 0.2 * std::sqrt(kInflation) : 0.05);
    }
    whole.conservativeResize(whole.rows() + rows.rows(), Eigen::NoChange);
    whole.bottomRows(rows.rows()) = rows;
  }
  const auto covariance = inverse_gram(whole, 1e-12);
  ASSERT_TRUE(covariance);
  Eigen::Index row = 0;
  std::vector<double> corner_eigenvalues, stripe_redundancies;
  for (std::size_t v = 0; v < views.size(); ++v) {
    const int d = views[v]->dimension();
    const ViewSummary& view = result->views[v];
    const double sigma_px = d == 2 ? 0.2 : 0.05;
    for (int i = 0; i < views[v]->size(); ++i, row += d) {
      const Eigen::MatrixXd own = whole.middleRows(row, d);
      const Eigen::MatrixXd redundant = Eigen::MatrixXd::Identity(d, d) - own * *covariance * own.transpose();
      const Eigen::VectorXd residual = view.residuals_px.segment(d * i, d) / sigma_px;
      const double square = residual.dot(redundant.inverse() * residual);
      EXPECT_NEAR(view.redundancy[static_cast<std::size_t>(i)], redundant.trace(), 1e-5);
      EXPECT_NEAR(view.standardised[static_cast<std::size_t>(i)], std::sqrt(square), 1e-4);
      (d == 2 ? corner_eigenvalues : stripe_redundancies).push_back(symmetric_eigen(redundant).values[0]);
    }
  }
  const auto median = [](std::vector<double>& values) {
    std::sort(values.begin(), values.end());
    return values[values.size() / 2];
  };
  // Baarda's: beyond the two-sided limit of probability exp(-8), that of 4 sigmas in two coordinates, and 0.8416 more
  // to be there four times in five.
  const GroupSummary& stripes = group(*result, View::Kind::stripes);
  EXPECT_NEAR(stripes.standardised_limit, 3.58625, 1e-5);
  EXPECT_NEAR(stripes.gross_error_px.value(), 0.05 * (3.58625 + 0.8416) / std::sqrt(median(stripe_redundancies)), 1e-4);
  // Two coordinates: drawn.
  const GroupSummary& corners = group(*result, View::Kind::corners);
  EXPECT_NEAR(corners.standardised_limit, 4, 1e-12);
  const double shift = corners.gross_error_px.value() / 0.2 * std::sqrt(median(corner_eigenvalues));
  std::mt19937_64 random(1);
  std::normal_distribution<double> normal;
  constexpr int kDraws = 40000;
  int seen = 0;
  for (int draw = 0; draw < kDraws; ++draw) {
    const double x = normal(random) + shift;
    seen += std::hypot(x, normal(random)) > 4;
  }
  EXPECT_NEAR(seen, 0.8 * kDraws, 4 * std::sqrt(0.8 * 0.2 * kDraws));
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
  EXPECT_EQ(one->views[3].standardised, three->views[3].standardised);
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
