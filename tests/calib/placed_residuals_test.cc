#include "calib/placed_residuals.h"

#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include "calib/image_cells.h"
#include "calib/residual_histogram.h"
#include "tests/solvers/synthetic.h"

namespace crumple {
namespace {

struct NoisyFit {
  Synthetic made = make_synthetic(
      {.placements = 6, .corner_sigma_px = 0.1, .stripe_sigma_px = 0.05, .feature_sigma_px = 0.1, .seed = 3});
  BundleResult bundle = refine(made.truth, made.observations, {}).value();
};

TEST(PlacedResiduals, LieWhereTheyWereMeasured) {
  const NoisyFit fit;
  const auto placed = placed_residuals(fit.made.observations, fit.bundle);
  ASSERT_EQ(placed.size(), 2U);
  const CornerView& corners = fit.made.observations.corners.front();
  EXPECT_EQ(placed[0].front().pixel, corners.pixels.front());
  EXPECT_EQ(placed[0].front().residual_px, fit.bundle.views.front().residuals_px.head<2>());
  EXPECT_FALSE(placed[0].front().normal);
  // A stripe's residual is what its predicted place has too much along the normal.
  std::size_t number = 0;
  for (const StripeView& view : fit.made.observations.stripes) {
    for (const double coordinate : view.coordinates_px) {
      const PlacedResidual& stripe = placed[1][number++];
      ASSERT_TRUE(stripe.normal);
      EXPECT_NEAR(stripe.normal->dot(stripe.pixel) - stripe.normal->dot(stripe.residual_px), coordinate, 1e-7);
    }
  }
  EXPECT_EQ(number, placed[1].size());
}

TEST(ImageCells, AMeanExplainsReadingsInOneAndTwoDirections) {
  std::vector<PlacedResidual> residuals;
  const Eigen::Vector2d mean(0.3, -0.2);
  for (int i = 0; i < 3; ++i) {
    const Eigen::Vector2d x = Eigen::Vector2d::UnitX(), oblique = Eigen::Vector2d(0.6, 0.8);
    residuals.push_back({{10.0 + i, 20}, x * x.dot(mean), x, 0.1, true});
    residuals.push_back({{10.0, 20.0 + i}, oblique * oblique.dot(mean), oblique, 0.1, true});
    residuals.push_back({{100.0 + i, 20}, x, x, 0.1, true});  // one direction alone has no mean
    residuals.push_back({{10, 20}, {5, 5}, {}, 0.1, false});  // an outlier
  }
  ImageCells cells = image_cells(residuals, {160, 120});
  EXPECT_EQ(cells.columns, 16);
  EXPECT_EQ(cells.rows, 12);
  const ImageCell& cell = cells.cells[2 * 16 + 1];
  EXPECT_EQ(cell.observations, 6U);
  // Six oblique readings know less of one coordinate than three readings of both: no mean yet.
  EXPECT_FALSE(cell.mean_px);
  residuals.insert(residuals.end(), residuals.begin(), residuals.end());
  for (int i = 0; i < 6; ++i) residuals.push_back({{10, 20}, mean, {}, 0.1, true});
  cells = image_cells(residuals, {160, 120});
  ASSERT_TRUE(cells.cells[2 * 16 + 1].mean_px);
  EXPECT_LT((*cells.cells[2 * 16 + 1].mean_px - mean).norm(), 1e-12);
  EXPECT_FALSE(cells.cells[2 * 16 + 10].mean_px);
  EXPECT_NEAR(cells.rms_mean_px, mean.norm(), 1e-12);
  EXPECT_NEAR(cells.covered, 2.0 / (16 * 12), 1e-12);
  EXPECT_EQ(cells.centre_px(2 * 16 + 1), Eigen::Vector2d(14.5, 24.5));
}

TEST(ImageCells, MeansOfNoiseAreAsLongAsExpected) {
  std::mt19937 random(7);
  std::normal_distribution<double> noise(0, 0.1);
  std::uniform_real_distribution<double> place(0, 1);
  std::vector<PlacedResidual> residuals;
  for (int i = 0; i < 6000; ++i) {
    const Eigen::Vector2d pixel(place(random) * 159, place(random) * 119), r(noise(random), noise(random));
    const double angle = 3 * place(random);
    const Eigen::Vector2d normal(std::cos(angle), std::sin(angle));
    const bool stripe = i % 2 == 0;
    residuals.push_back({pixel, stripe ? Eigen::Vector2d(normal * r.x()) : r,
                         stripe ? std::optional(normal) : std::nullopt, 0.1, true});
  }
  const ImageCells cells = image_cells(residuals, {160, 120});
  EXPECT_EQ(cells.covered, 1);
  EXPECT_NEAR(cells.rms_mean_px / cells.expected_px, 1, 0.1);  // 384 coordinates: 4 % is one standard deviation
}

TEST(ResidualHistogram, CountsEveryCoordinateOnce) {
  const NoisyFit fit;
  const auto histograms = residual_histograms(fit.bundle);
  ASSERT_EQ(histograms.size(), fit.bundle.groups.size());
  for (std::size_t g = 0; g < histograms.size(); ++g) {
    const GroupSummary& group = fit.bundle.groups[g];
    std::size_t count = histograms[g].beyond;
    for (const std::size_t bin : histograms[g].accepted) count += bin;
    for (const std::size_t bin : histograms[g].outliers) count += bin;
    EXPECT_EQ(count, group.observations * static_cast<std::size_t>(View::dimension_of(group.kind)));
    EXPECT_NEAR(histograms[g].mean, 0, 0.1);
    EXPECT_NEAR(histograms[g].deviation, 1, 0.08);
  }
}

}  // namespace
}  // namespace crumple
