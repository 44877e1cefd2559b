#include "solvers/minimise.h"

#include <cmath>

#include <gtest/gtest.h>

#include "solvers/covariance.h"
#include "tests/solvers/ceres_minimise.h"
#include "tests/solvers/synthetic.h"

namespace crumple {
namespace {

using Views = std::vector<std::unique_ptr<View>>;

// One refinement, ready to run.
struct Problem {
  Synthetic made;
  CalibrationState start;
  Views views;  // they refer to made
  std::vector<ViewWeights> weights;
  std::set<BlockId> held;
  MinimiseOptions options = {};
};

std::unique_ptr<Problem> problem(const SyntheticOptions& options) {
  auto problem = std::make_unique<Problem>();
  problem->made = make_synthetic(options);
  problem->start = disturbed(problem->made.truth, 3);
  problem->views = make_views(problem->made.observations, problem->start.board_of);
  for (const auto& view : problem->views) {
    problem->weights.push_back({0.2, 1, std::vector<char>(static_cast<std::size_t>(view->size()), 1)});
  }
  problem->held = {{BlockId::Kind::mount, 0}, {BlockId::Kind::scale, 0}};
  return problem;
}

SyntheticOptions noisy() {
  return {
      .placements = 5, .corner_sigma_px = 0.2, .stripe_sigma_px = 0.1, .feature_sigma_px = 0.3, .warp_mm = {0.6, -0.4}};
}

std::unique_ptr<Problem> all_kinds() { return problem(noisy()); }

std::unique_ptr<Problem> discs() {
  SyntheticOptions options = noisy();
  options.disc_radius_mm = 9;
  return problem(options);
}

std::unique_ptr<Problem> a_lens_held() {
  auto made = problem(noisy());
  made->held.insert({BlockId::Kind::lens, 0});
  return made;
}

std::unique_ptr<Problem> outliers_and_inflation() {
  auto made = problem(noisy());
  for (std::size_t v = 0; v < made->weights.size(); ++v) {
    for (std::size_t i = v; i < made->weights[v].inlier.size(); i += 7) made->weights[v].inlier[i] = 0;
    made->weights[v].inflation = 1 + 0.5 * static_cast<double>(v % 4);
  }
  return made;
}

std::unique_ptr<Problem> cauchy_loss() {
  auto made = problem(noisy());
  made->options.cauchy_scale = 2.5;
  return made;
}

// Every other placement is of a second board, and the scales of both are known by a prior alone.
std::unique_ptr<Problem> two_boards_of_uncertain_scale() {
  auto made = problem(noisy());
  CalibrationState& start = made->start;
  start.boards.push_back(start.boards[0]);
  start.boards[1].name = "second";
  for (std::size_t p = 0; p < start.board_of.size(); ++p) start.board_of[p] = p % 2;
  made->views = make_views(made->made.observations, start.board_of);
  made->held = {{BlockId::Kind::mount, 0}};
  CalibrationState about = start;
  about.boards[0].scale = 1.002;
  about.boards[1].scale = 0.999;
  made->options.priors = {Prior::create("certificates", {{{BlockId::Kind::scale, 0}}, {{BlockId::Kind::scale, 1}}},
                                        about, Eigen::Vector2d(1e-6, 4e-6).asDiagonal())
                              .value()};
  return made;
}

std::unique_ptr<Problem> rational_lenses_under_a_weak_prior() {
  SyntheticOptions options = noisy();
  options.model = "LENSMODEL_OPENCV8";
  auto made = problem(options);
  for (const std::size_t sensor : {0U, 1U}) {
    const BlockId lens{BlockId::Kind::lens, sensor};
    const Eigen::Vector3d sigma(1, 3, 10);
    made->options.priors.push_back(
        Prior::create("weak", {{lens, 9}, {lens, 10}, {lens, 11}}, made->start, sigma.cwiseAbs2().asDiagonal())
            .value());
  }
  return made;
}

// From one state to another, in the tangents of the common parameters.
Eigen::VectorXd common_step(const Parameters& parameters, const CalibrationState& from, const CalibrationState& to) {
  Eigen::VectorXd step(parameters.common_size());
  for (const BlockId& block : parameters.common_blocks()) {
    step.segment(*parameters.common_offset(block), tangent_size(block, from)) = block_step(block, from, to);
  }
  return step;
}

struct ProblemCase {
  const char* name;
  std::unique_ptr<Problem> (*make)();
};

class MinimiseAndCeres : public testing::TestWithParam<ProblemCase> {};

TEST_P(MinimiseAndCeres, ReachTheSameOptimum) {
  const auto given = GetParam().make();
  CalibrationState ours = given->start, theirs = given->start;
  const Parameters parameters(given->start, given->views, given->held);
  const auto minimum = minimise(given->views, given->weights, parameters, given->options, ours);
  ASSERT_TRUE(minimum) << minimum.error().message;
  EXPECT_TRUE(minimum->converged);
  const auto oracle = minimise_by_ceres(given->views, given->weights, parameters, given->options, theirs);
  ASSERT_TRUE(oracle) << oracle.error().message;
  EXPECT_TRUE(oracle->converged);
  EXPECT_LE(minimum->iterations, oracle->iterations);
  EXPECT_NEAR(minimum->final_cost, oracle->final_cost, 1e-9 * oracle->final_cost);
  // In standard deviations: the last digits of terms that the observations hardly tell apart mean nothing.
  const auto covariance = JointCovariance::create(minimum->equations, ours);
  ASSERT_TRUE(covariance) << covariance.error().message;
  const Eigen::VectorXd sigma = covariance->common().diagonal().cwiseSqrt();
  const Eigen::VectorXd apart = common_step(parameters, theirs, ours).cwiseQuotient(sigma).cwiseAbs();
  for (Eigen::Index i = 0; i < apart.size(); ++i) {
    EXPECT_LT(apart[i], 1e-5) << covariance->names()[static_cast<std::size_t>(i)];
  }
}

INSTANTIATE_TEST_SUITE_P(
    Of, MinimiseAndCeres,
    testing::Values(ProblemCase{"AllKinds", all_kinds}, ProblemCase{"Discs", discs},
                    ProblemCase{"ALensHeld", a_lens_held}, ProblemCase{"OutliersAndInflation", outliers_and_inflation},
                    ProblemCase{"CauchyLoss", cauchy_loss},
                    ProblemCase{"TwoBoardsOfUncertainScale", two_boards_of_uncertain_scale},
                    ProblemCase{"RationalLensesUnderAWeakPrior", rational_lenses_under_a_weak_prior}),
    [](const testing::TestParamInfo<ProblemCase>& each) { return each.param.name; });

TEST(Minimise, TheSameBitsAtAnyThreadCount) {
  for (const auto& make : {two_boards_of_uncertain_scale, discs, rational_lenses_under_a_weak_prior}) {
    const auto given = make();
    const Parameters parameters(given->start, given->views, given->held);
    std::vector<double> costs;
    std::vector<Eigen::VectorXd> steps;
    for (const int threads : {1, 2, 5}) {
      CalibrationState state = given->start;
      given->options.threads = threads;
      const auto minimum = minimise(given->views, given->weights, parameters, given->options, state);
      ASSERT_TRUE(minimum) << minimum.error().message;
      costs.push_back(minimum->final_cost);
      steps.push_back(common_step(parameters, given->start, state));
    }
    for (std::size_t i = 1; i < costs.size(); ++i) {
      EXPECT_EQ(costs[i], costs[0]);
      EXPECT_EQ(steps[i], steps[0]);
    }
  }
}

TEST(Minimise, AStartThatPredictsNothingIsAnErrorAndIsLeftAlone) {
  const auto given = problem({.placements = 3});
  given->start.world_from_board[1].translation.z() = -800;
  const Parameters parameters(given->start, given->views, given->held);
  EXPECT_FALSE(minimise(given->views, given->weights, parameters, {}, given->start));
  EXPECT_EQ(given->start.world_from_board[1].translation.z(), -800);
}

TEST(Minimise, SaysThatItRanOutOfIterations) {
  const auto given = all_kinds();
  const Parameters parameters(given->start, given->views, given->held);
  const auto minimum = minimise(given->views, given->weights, parameters, {.max_iterations = 2}, given->start);
  ASSERT_TRUE(minimum) << minimum.error().message;
  EXPECT_FALSE(minimum->converged);
  EXPECT_EQ(minimum->iterations, 2);
  EXPECT_LT(minimum->final_cost, minimum->initial_cost);
}

}  // namespace
}  // namespace crumple
