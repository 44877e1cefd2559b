#include "calib/regional_tests.h"

#include <random>

#include <gtest/gtest.h>

namespace crumple {
namespace {

constexpr ImageSize kRegionalSize{900, 600};
constexpr double kRegionalSigma_px = 0.1;

// A camera with corners and a projector with stripes.
std::vector<RegionalTest> tests_of(const std::vector<std::vector<PlacedResidual>>& residuals,
                                   const Inflation& inflation = {}) {
  Rig rig;
  for (const SensorKind kind : {SensorKind::camera, SensorKind::projector}) {
    rig.sensors.push_back(
        {"s", kind, Lens::undistorted("LENSMODEL_PINHOLE", kRegionalSize, 1000, 1000, {449.5, 299.5}).value(), {}});
  }
  return regional_tests(residuals,
                        {{.sensor = 0, .kind = View::Kind::corners}, {.sensor = 1, .kind = View::Kind::stripes}}, rig,
                        inflation);
}

std::vector<std::vector<PlacedResidual>> noise(int count, std::mt19937_64& random) {
  std::vector<std::vector<PlacedResidual>> residuals(2);
  std::normal_distribution<double> normal(0, kRegionalSigma_px);
  std::uniform_real_distribution<double> place;
  for (int i = 0; i < count; ++i) {
    const Eigen::Vector2d pixel(900 * place(random) - 0.5, 600 * place(random) - 0.5);
    residuals[0].push_back({pixel, {normal(random), normal(random)}, std::nullopt, kRegionalSigma_px, true});
    const Eigen::Vector2d along = i % 2 == 0 ? Eigen::Vector2d(1, 0) : Eigen::Vector2d(0.6, 0.8);
    residuals[1].push_back({pixel, along * normal(random), along, kRegionalSigma_px, true, View::Kind::stripes});
  }
  return residuals;
}

TEST(RegionalTests, OfNoiseAreChiSquareDistributed) {
  constexpr int kTrials = 400;
  std::mt19937_64 random(3);
  double square[2] = {0, 0};
  int below_a_tenth[2] = {0, 0};
  for (int i = 0; i < kTrials; ++i) {
    const auto tests = tests_of(noise(400, random));
    ASSERT_EQ(tests.size(), 2U);
    for (std::size_t g = 0; g < 2; ++g) {
      EXPECT_EQ(tests[g].degrees_of_freedom, 18);
      square[g] += tests[g].chi_square / kTrials;
      below_a_tenth[g] += tests[g].probability < 0.1 ? 1 : 0;
    }
  }
  for (std::size_t g = 0; g < 2; ++g) {
    EXPECT_NEAR(square[g], 18, 4 * std::sqrt(2 * 18.0 / kTrials));
    EXPECT_NEAR(below_a_tenth[g], 0.1 * kTrials, 4 * std::sqrt(0.09 * kTrials));
  }
}

TEST(RegionalTests, NameThePartThatIsOff) {
  std::mt19937_64 random(4);
  auto residuals = noise(900, random);
  for (PlacedResidual& residual : residuals[0]) {
    if (residual.pixel.x() > 600 && residual.pixel.y() < 200) residual.residual_px.x() += kRegionalSigma_px;
  }
  const auto tests = tests_of(residuals);
  EXPECT_TRUE(tests[0].pattern());
  EXPECT_EQ(tests[0].worst_part, "upper right");
  EXPECT_LT(tests[0].worst_probability, 1e-6);
  EXPECT_NEAR(tests[0].worst_mean_px.x(), kRegionalSigma_px, 4 * kRegionalSigma_px / 10);
  EXPECT_FALSE(tests[1].pattern());
}

// A mean of a hundredth of a sigma, of half a million readings: far beyond chance, and nothing that matters.
TEST(RegionalTests, DoNotSpeakOfAPatternFarBelowTheScatter) {
  std::mt19937_64 random(6);
  auto residuals = noise(500000, random);
  for (PlacedResidual& residual : residuals[0]) {
    residual.residual_px.x() += (residual.pixel.x() > 450 ? 0.02 : -0.02) * kRegionalSigma_px;
  }
  const auto tests = tests_of(residuals);
  EXPECT_LT(tests[0].probability, 1e-12);
  EXPECT_NEAR(tests[0].rms_sigmas, 0.02 / std::sqrt(3), 0.004);  // the parts between left and right cancel; x alone
  EXPECT_FALSE(tests[0].pattern());
}

// The middle's mean of 0.05 sigma, of very many readings, is the less likely one; the corner's of half a sigma matters.
TEST(RegionalTests, ALargeMeanIsNotHiddenByALessLikelySmallOne) {
  std::vector<std::vector<PlacedResidual>> residuals(2);
  const auto put = [&](const Eigen::Vector2d& pixel, double mean, int count) {
    for (int i = 0; i < count; ++i) {
      const double apart = i % 2 == 0 ? 1 : -1;  // of the size of sigma
      residuals[0].push_back(
          {pixel, kRegionalSigma_px * Eigen::Vector2d(mean + apart, apart), std::nullopt, kRegionalSigma_px, true});
    }
  };
  put({450, 300}, 0.05, 400000);
  put({10, 10}, 0.5, 3000);
  for (const Eigen::Vector2d& pixel : {Eigen::Vector2d(890, 10), Eigen::Vector2d(10, 590), Eigen::Vector2d(890, 590)}) {
    put(pixel, 0, 1000);
  }
  const auto tests = tests_of(residuals, {.corners = 10});
  EXPECT_EQ(tests[0].worst_part, "middle");
  EXPECT_LT(tests[0].rms_sigmas, kPatternSigmas);
  EXPECT_TRUE(tests[0].pattern());
}

// So far out that every part's probability is 0 in double precision.
TEST(RegionalTests, NameTheWorstOfPartsThatAreAllImpossible) {
  std::mt19937_64 random(7);
  auto residuals = noise(60000, random);
  for (PlacedResidual& residual : residuals[0]) {
    residual.residual_px.y() += (residual.pixel.x() > 600 && residual.pixel.y() > 400 ? 2 : 1) * kRegionalSigma_px;
  }
  const auto tests = tests_of(residuals);
  EXPECT_EQ(tests[0].worst_probability, 0);
  EXPECT_EQ(tests[0].worst_part, "lower right");
}

TEST(RegionalTests, CountCorrelatedObservationsForTheirEffectiveNumber) {
  std::mt19937_64 random(5);
  const auto residuals = noise(300, random);
  const double independent = tests_of(residuals)[1].chi_square;
  EXPECT_NEAR(tests_of(residuals, {.stripes = 4})[1].chi_square, independent / 4, 1e-9);
}

TEST(RegionalTests, LeaveOutWhatTooFewTell) {
  std::vector<std::vector<PlacedResidual>> residuals(2);
  const Eigen::Vector2d place(10, 10);
  for (int i = 0; i < 5; ++i) {
    residuals[0].push_back({place, {0.1, 0}, std::nullopt, kRegionalSigma_px, i < 2});
    residuals[1].push_back({place, {0.1, 0}, Eigen::Vector2d(1, 0), kRegionalSigma_px, true, View::Kind::stripes});
  }
  const auto tests = tests_of(residuals);
  EXPECT_EQ(tests[0].parts, 0);
  EXPECT_EQ(tests[0].probability, 1);
  EXPECT_EQ(tests[1].degrees_of_freedom, 1);
  EXPECT_NEAR(tests[1].chi_square, 5, 1e-9);
}

}  // namespace
}  // namespace crumple
