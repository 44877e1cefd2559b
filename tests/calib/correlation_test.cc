#include "calib/correlation.h"

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/solvers/synthetic.h"

namespace crumple {
namespace {

// Legendre's polynomial of degree n, of mean square 1 over [-1, 1].
double legendre(int n, double x) { return std::sqrt(2 * n + 1) * std::legendre(static_cast<unsigned>(n), x); }

// Adds to a view's readings polynomials of up to fourth degree over the view's bounding box, with random coefficients
// of that sigma. Along each of them the readings err by sqrt(n) times as much.
void add_smooth_errors(double sigma_px, std::mt19937_64& random, StripeView& view) {
  Eigen::Vector2d least = view.camera_pixels.front(), most = least;
  for (const Eigen::Vector2d& p : view.camera_pixels) {
    least = least.cwiseMin(p);
    most = most.cwiseMax(p);
  }
  std::normal_distribution<double> draw(0, sigma_px);
  for (int degree = 0; degree <= 4; ++degree) {
    for (int k = 0; k <= degree; ++k) {
      const double coefficient = draw(random);
      for (std::size_t i = 0; i < view.camera_pixels.size(); ++i) {
        const Eigen::Vector2d p =
            (2 * (view.camera_pixels[i] - least)).cwiseQuotient(most - least) - Eigen::Vector2d::Ones();
        view.coordinates_px[i] += coefficient * legendre(degree - k, p.x()) * legendre(k, p.y());
      }
    }
  }
}

struct Spread {
  double mean = 0;
  double variance = 0;
  double degrees_of_freedom = 0;  // mean
};

// Of the stripes' inflation over campaigns that differ in their noise; smooth errors such that n of them weigh as much
// as `smooth` times the noise.
Spread spread_of_inflation(double smooth) {
  constexpr double kNoise_px = 0.05;
  std::vector<Inflation> found;
  for (unsigned seed = 1; seed <= 20; ++seed) {
    Synthetic made = make_synthetic(
        {.placements = 8, .corner_sigma_px = 0.1, .stripe_sigma_px = kNoise_px, .feature_sigma_px = 0.1, .seed = seed});
    std::mt19937_64 random(seed);
    for (StripeView& view : made.observations.stripes) {
      if (smooth == 0) break;
      add_smooth_errors(kNoise_px * std::sqrt(smooth / static_cast<double>(view.camera_pixels.size())), random, view);
    }
    const auto bundle = refine(made.truth, made.observations, {});
    if (!bundle) return {};
    found.push_back(inflation(made.observations, *bundle, 1));
  }
  Spread spread;
  const auto count = static_cast<double>(found.size());
  for (const Inflation& each : found) {
    spread.mean += each.stripes / count;
    spread.degrees_of_freedom += each.stripe_degrees_of_freedom / count;
  }
  for (const Inflation& each : found) spread.variance += std::pow(each.stripes - spread.mean, 2) / (count - 1);
  return spread;
}

// Errors of whole views no larger than noise, which no pair of neighbours shows.
TEST(Correlation, WeakSmoothErrorsCountForWhatTheyAre) {
  const Spread spread = spread_of_inflation(0.8);
  EXPECT_NEAR(spread.mean, 1.8, 0.1);
  // As a chi-square with that many degrees of freedom scatters; 20 campaigns tell a variance to 32 %.
  EXPECT_NEAR(spread.variance / (2 * spread.mean * spread.mean / spread.degrees_of_freedom), 1, 0.8);
}

TEST(Correlation, IndependentReadingsCountForLittleLess) {
  const Spread spread = spread_of_inflation(0);
  ASSERT_GT(spread.mean, 0);
  EXPECT_LT(spread.mean, 1.08);
}

TEST(Correlation, IndependentReadingsCountForThemselves) {
  const Synthetic made =
      make_synthetic({.placements = 12, .corner_sigma_px = 0.1, .stripe_sigma_px = 0.05, .feature_sigma_px = 0.1});
  const auto bundle = refine(made.truth, made.observations, {});
  ASSERT_TRUE(bundle);
  const Inflation counted = inflation(made.observations, *bundle, 1);
  EXPECT_LT(counted.stripes, 1.5);
  EXPECT_LT(counted.corners, 1.2);
}

TEST(Correlation, ReadingsThatErrTogetherCountAsFew) {
  Synthetic made =
      make_synthetic({.placements = 12, .corner_sigma_px = 0.1, .stripe_sigma_px = 0.02, .feature_sigma_px = 0.1});
  for (StripeView& view : made.observations.stripes) {
    for (std::size_t i = 0; i < view.coordinates_px.size(); ++i) {
      view.coordinates_px[i] +=
          0.08 * std::sin(view.camera_pixels[i].x() / 50) * std::cos(view.camera_pixels[i].y() / 50);
    }
  }
  const auto bundle = refine(made.truth, made.observations, {});
  ASSERT_TRUE(bundle);
  EXPECT_GT(inflation(made.observations, *bundle, 1).stripes, 2);
}

// Far below the noise of a reading: rings of neighbours see a third of it (1.3).
TEST(Correlation, AWeakErrorOverTheWholeViewCounts) {
  Synthetic made =
      make_synthetic({.placements = 12, .corner_sigma_px = 0.1, .stripe_sigma_px = 0.05, .feature_sigma_px = 0.1});
  double sign = 1;
  for (StripeView& view : made.observations.stripes) {
    Eigen::Vector2d mean = Eigen::Vector2d::Zero();
    for (const Eigen::Vector2d& p : view.camera_pixels) mean += p / static_cast<double>(view.camera_pixels.size());
    for (std::size_t i = 0; i < view.coordinates_px.size(); ++i) {
      view.coordinates_px[i] += sign * 0.03 * (view.camera_pixels[i] - mean).prod() / 15000;
    }
    sign = -sign;
  }
  const auto bundle = refine(made.truth, made.observations, {});
  ASSERT_TRUE(bundle);
  EXPECT_GT(inflation(made.observations, *bundle, 1).stripes, 2);
}

TEST(Correlation, CornersOfABentSheetCountAsFew) {
  Synthetic made =
      make_synthetic({.placements = 12, .corner_sigma_px = 0.03, .stripe_sigma_px = 0.05, .feature_sigma_px = 0.1});
  for (CornerView& view : made.observations.corners) {
    for (Eigen::Vector2d& pixel : view.pixels) pixel.x() += 0.1 * std::sin(pixel.x() / 60) * std::cos(pixel.y() / 60);
  }
  const auto bundle = refine(made.truth, made.observations, {});
  ASSERT_TRUE(bundle);
  EXPECT_GT(inflation(made.observations, *bundle, 1).corners, 2);
}

}  // namespace
}  // namespace crumple
