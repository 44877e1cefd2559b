// An earlier rig as what is known before a refinement.
#include "calib/rig_prior.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Cholesky>
#include <gtest/gtest.h>

#include "calib/calibrate.h"
#include "solvers/bundle.h"
#include "solvers/parameters.h"
#include "tests/solvers/made_system.h"

namespace crumple {
namespace {

// A campaign in two halves: the same stations, boards seen in the first or the second.
struct Halves {
  MadeSystem made;
  Observations first, second;
};

Halves halves() {
  Halves result{make_system({.stations = 24, .tracker_placements = 12, .seed = 4}), {}, {}};
  const auto split = [](const auto& views, auto& first, auto& second) {
    for (const auto& view : views) (view.station.value_or(0) < 12 ? first : second).push_back(view);
  };
  const Observations& all = result.made.observations;
  result.first.placement_count = result.second.placement_count = all.placement_count;
  split(all.corners, result.first.corners, result.second.corners);
  split(all.stripes, result.first.stripes, result.second.stripes);
  split(all.leds, result.first.leds, result.second.leds);
  return result;
}

Rig with_covariance(const BundleResult& bundle) {
  Rig rig = bundle.state.rig;
  rig.covariance = rig_covariance(bundle);
  return rig;
}

TEST(RigPrior, HoldsEveryParameterOfTheRigThatIsTouched) {
  const Halves data = halves();
  const auto first = refine(data.made.truth, data.first, {.reject_outliers = false});
  ASSERT_TRUE(first) << first.error().message;
  const Rig rig = with_covariance(*first);
  const auto prior = rig_prior(rig, data.made.truth, data.second);
  ASSERT_TRUE(prior) << prior.error().message;
  // Mounts that hold the frames have no row.
  EXPECT_EQ(prior->held, (std::set<BlockId>{{BlockId::Kind::mount, 0}, {BlockId::Kind::mount, 2}}));
  EXPECT_EQ(static_cast<int>(prior->prior.terms().size()), first->covariance.rig_rows());
  const Eigen::VectorXd sigmas = prior->prior.sigmas();
  for (std::size_t i = 0; i < prior->prior.terms().size(); ++i) {
    const PriorTerm& term = prior->prior.terms()[i];
    const std::string name = parameter_names(term.block, prior->state)[static_cast<std::size_t>(term.row)];
    const auto found = std::find(rig.covariance.names.begin(), rig.covariance.names.end(), name);
    ASSERT_NE(found, rig.covariance.names.end()) << name;
    const auto row = found - rig.covariance.names.begin();
    EXPECT_NEAR(sigmas[static_cast<Eigen::Index>(i)] / std::sqrt(rig.covariance.matrix(row, row)), 1, 1e-6) << name;
  }
}

// A rig from the first half and the observations of the second give what both halves together give, as far as the
// first half's boards do not stay for the second.
TEST(RigPrior, CarriesAnEarlierCalibrationOver) {
  const Halves data = halves();
  const auto first = refine(data.made.truth, data.first, {.reject_outliers = false});
  ASSERT_TRUE(first) << first.error().message;
  const auto prior = rig_prior(with_covariance(*first), data.made.truth, data.second);
  ASSERT_TRUE(prior) << prior.error().message;
  const BundleOptions options{.reject_outliers = false, .held = prior->held, .priors = {prior->prior}};
  const auto second = refine(prior->state, data.second, options);
  ASSERT_TRUE(second) << second.error().message;
  for (const std::string name : {"cam0.fx", "track1.rotation_y", "led0.x", "proj0.translation_x"}) {
    const auto row = [&](const std::vector<std::string>& names) {
      return std::find(names.begin(), names.end(), name) - names.begin();
    };
    const auto a = row(first->covariance.names()), b = row(second->covariance.names());
    EXPECT_LT(second->covariance.common()(b, b), 0.8 * first->covariance.common()(a, a)) << name;
  }
}

TEST(RigPrior, UnknownLedsAreEstimatedFreely) {
  const Halves data = halves();
  const auto first = refine(data.made.truth, data.first, {.reject_outliers = false});
  ASSERT_TRUE(first) << first.error().message;
  Rig rig = with_covariance(*first);
  rig.leds[2].name = "another";
  const auto prior = rig_prior(rig, data.made.truth, data.second);
  ASSERT_TRUE(prior) << prior.error().message;
  const BlockId led{BlockId::Kind::led, 2};
  EXPECT_FALSE(prior->held.contains(led));
  for (const BlockId& block : prior->prior.blocks()) EXPECT_NE(block, led);
}

// By the rules for normal distributions: what is estimated of the others is as if the LED were not there, and the LED
// follows by its regression on them.
TEST(RigPrior, AnLedThatIsCarriedFollowsTheOthersAndMovesNone) {
  Halves data = halves();
  const auto first = refine(data.made.truth, data.first, {.reject_outliers = false});
  ASSERT_TRUE(first) << first.error().message;
  constexpr std::size_t kHidden = 2;
  const BlockId led{BlockId::Kind::led, kHidden};
  for (LedView& view : data.second.leds) {
    const auto at = std::find(view.leds.begin(), view.leds.end(), kHidden) - view.leds.begin();
    if (at == std::ssize(view.leds)) continue;
    view.leds.erase(view.leds.begin() + at);
    view.pixels.erase(view.pixels.begin() + at);
  }
  const Rig rig = with_covariance(*first);
  const auto refined = [&](const std::set<BlockId>& carried) {
    const auto known = rig_prior(rig, data.made.truth, data.second, {}, carried).value();
    const BundleOptions options{.reject_outliers = false, .held = known.held, .priors = {known.prior}};
    return refine(known.state, data.second, options).value();
  };
  const BundleResult without = refined({}), with = refined({led});
  EXPECT_TRUE(without.covariance.of({led}, without.state).isZero(0));

  const std::vector<BlockId> others = rig_prior(rig, data.made.truth, data.second)->prior.blocks();
  ASSERT_EQ(std::count(others.begin(), others.end(), led), 0);
  std::vector<BlockId> all = others;
  all.push_back(led);
  const CalibrationState& before = first->state;
  const Eigen::MatrixXd prior = first->covariance.of(all, before), now = with.covariance.of(all, with.state);
  const Eigen::MatrixXd alone = without.covariance.of(others, without.state);
  const Eigen::Index n = alone.rows();
  const Eigen::VectorXd sigma = alone.diagonal().cwiseSqrt();
  Eigen::VectorXd step(n);
  Eigen::Index row = 0;
  for (const BlockId& block : others) {
    const Eigen::VectorXd of_block = block_step(block, before, with.state);
    const Eigen::VectorXd apart = block_step(block, without.state, with.state);
    EXPECT_LT(apart.cwiseQuotient(sigma.segment(row, apart.size())).cwiseAbs().maxCoeff(), 1e-3);
    step.segment(row, of_block.size()) = of_block;
    row += of_block.size();
  }
  const Eigen::VectorXd scale = sigma.cwiseInverse();
  EXPECT_LT((scale.asDiagonal() * (now.topLeftCorner(n, n) - alone) * scale.asDiagonal()).cwiseAbs().maxCoeff(), 1e-3);

  const Eigen::VectorXd known = prior.topLeftCorner(n, n).diagonal().cwiseSqrt().cwiseInverse();
  const Eigen::MatrixXd equilibrated = known.asDiagonal() * prior.topLeftCorner(n, n) * known.asDiagonal();
  const Eigen::MatrixXd scaled_cross = known.asDiagonal() * prior.topRightCorner(n, 3);
  const Eigen::MatrixXd solved = equilibrated.ldlt().solve(scaled_cross);
  const Eigen::MatrixXd regression = solved.transpose() * known.asDiagonal();  // 3 x n
  const Eigen::Matrix3d left = prior.bottomRightCorner<3, 3>() - regression * prior.topRightCorner(n, 3);
  const Eigen::Matrix3d expected = left + regression * alone * regression.transpose();
  const Eigen::Matrix3d found = now.bottomRightCorner<3, 3>();
  EXPECT_LT((found - expected).norm(), 0.01 * expected.norm());
  EXPECT_LT(found.trace(), prior.diagonal().tail<3>().sum());
  const Eigen::Vector3d moved = block_step(led, before, with.state);
  const Eigen::Vector3d followed = regression * step;
  EXPECT_LT((moved - followed).norm(), 0.02 * std::sqrt(expected.trace()));
  EXPECT_GT(moved.norm(), 0);
}

TEST(RigPrior, RefusesWhatIsAnotherRig) {
  const Halves data = halves();
  EXPECT_FALSE(rig_prior(data.made.truth.rig, data.made.truth, data.second));  // no covariance
  const auto first = refine(data.made.truth, data.first, {.reject_outliers = false});
  ASSERT_TRUE(first) << first.error().message;
  const Rig rig = with_covariance(*first);
  CalibrationState other_frame = data.made.truth;
  std::swap(other_frame.rig.sensors[2].name, other_frame.rig.sensors[3].name);
  const auto swapped = rig_prior(rig, other_frame, data.second);
  ASSERT_FALSE(swapped);
  EXPECT_NE(swapped.error().message.find("order"), std::string::npos) << swapped.error().message;
  CalibrationState other_lens = data.made.truth;
  other_lens.rig.sensors[0].lens =
      *Lens::undistorted("LENSMODEL_PINHOLE", {1024, 768}, 1400, 1400, Eigen::Vector2d(511, 383));
  EXPECT_FALSE(rig_prior(rig, other_lens, data.second));
}

}  // namespace
}  // namespace crumple
