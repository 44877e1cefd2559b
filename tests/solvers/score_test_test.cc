#include "solvers/score_test.h"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "tests/solvers/synthetic.h"

namespace crumple {
namespace {

const BundleOptions kKnownNoise{
    .reject_outliers = false,
    .known_sigma_px = {{"cam0.corners", 0.1}, {"cam0.features", 0.1}, {"proj0.stripes", 0.08}},
    .estimate_known_sigmas = false};

double whitened_square_sum(const BundleResult& result) {
  double sum = 0;
  for (const ViewSummary& view : result.views) {
    const double sigma_px = view.kind == View::Kind::stripes ? 0.08 : 0.1;
    sum += view.residuals_px.squaredNorm() / (sigma_px * sigma_px);
  }
  return sum;
}

Synthetic bent_board() {
  return make_synthetic(
      {.corner_sigma_px = 0.1, .stripe_sigma_px = 0.08, .feature_sigma_px = 0.1, .seed = 3, .warp_mm = {0.3, -0.15}});
}

ScoreTester::Columns by_warp(const ScoreTester& tester, const CalibrationState& state) {
  ScoreTester::Columns columns;
  for (std::size_t v = 0; v < tester.views().size(); ++v) {
    const auto& blocks = tester.views()[v]->blocks();
    const auto at = std::find(blocks.begin(), blocks.end(), BlockId{BlockId::Kind::warp, 0}) - blocks.begin();
    columns.emplace_back(v,
                         block_jacobian(*tester.views()[v], tester.evaluation(v), state, static_cast<std::size_t>(at)));
  }
  return columns;
}

// Freeing the warp is an alternative that can be refined in full.
TEST(ScoreTester, PredictsWhatARefinementWithTheFurtherParametersFinds) {
  const Synthetic made = bent_board();
  CalibrationState start = made.truth;
  start.boards[0].warp_mm.setZero();
  const auto without = refine(start, made.observations, kKnownNoise);
  BundleOptions freed = kKnownNoise;
  freed.estimate_warp = true;
  const auto with = refine(start, made.observations, freed);
  ASSERT_TRUE(without && with);
  const auto tester = ScoreTester::create(made.observations, *without, kKnownNoise);
  ASSERT_TRUE(tester);
  const ScoreOutcome outcome = tester->test(by_warp(*tester, without->state));
  const double fallen = whitened_square_sum(*without) - whitened_square_sum(*with);
  EXPECT_EQ(outcome.degrees, 2);
  EXPECT_NEAR(outcome.gain, fallen, 0.01 * fallen);
  EXPECT_GT(fallen, 100);
  const Eigen::MatrixXd covariance = with->covariance.of({{BlockId::Kind::warp, 0}}, with->state);
  for (int i = 0; i < 2; ++i) {
    EXPECT_NEAR(outcome.estimate[i], with->state.boards[0].warp_mm[i], 0.02 * std::sqrt(covariance(i, i)) + 1e-3);
    EXPECT_NEAR(outcome.sigma[i], std::sqrt(covariance(i, i)), 0.01 * std::sqrt(covariance(i, i)));
  }
}

// The parameters that were refined explain nothing more, and directions that they follow are not tested.
TEST(ScoreTester, WhatTheRefinementFollowsIsNotTested) {
  const Synthetic made = bent_board();
  const auto result = refine(made.truth, made.observations, kKnownNoise);
  ASSERT_TRUE(result);
  const auto tester = ScoreTester::create(made.observations, *result, kKnownNoise);
  ASSERT_TRUE(tester);
  ScoreTester::Columns columns;
  for (std::size_t v = 0; v < tester->views().size(); ++v) {
    const auto& blocks = tester->views()[v]->blocks();
    const auto lens = std::find(blocks.begin(), blocks.end(), BlockId{BlockId::Kind::lens, 0});
    if (lens == blocks.end()) continue;
    columns.emplace_back(v, block_jacobian(*tester->views()[v], tester->evaluation(v), result->state,
                                           static_cast<std::size_t>(lens - blocks.begin())));
  }
  const ScoreOutcome outcome = tester->test(columns);
  EXPECT_EQ(outcome.degrees, 0);
  EXPECT_EQ(outcome.gain, 0);
}

}  // namespace
}  // namespace crumple
