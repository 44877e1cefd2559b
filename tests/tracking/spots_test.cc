#include "tracking/spots.h"

#include <Eigen/LU>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/solvers/gradients.h"
#include "tests/tracking/made_spots.h"

namespace crumple {
namespace {

using testing::HasSubstr;

TEST(SpotFit, DerivativesMatchCentralDifferences) {
  const SpotModel model{{10.3, 20.8}, 0.9, 700, 12};
  for (int v = 18; v <= 23; ++v) {
    for (int u = 8; u <= 13; ++u) {
      const auto level = [&](const Eigen::VectorXd& p) {
        return Eigen::VectorXd::Constant(1, spot_level({{p[0], p[1]}, p[2], p[3], p[4]}, u, v).level);
      };
      Eigen::VectorXd at(5);
      at << 10.3, 20.8, 0.9, 700, 12;
      const Eigen::MatrixXd numeric = central_differences(level, at, 1e-5);
      EXPECT_LT((numeric - spot_level(model, u, v).derivative).cwiseAbs().maxCoeff(), 1e-5);
    }
  }
}

// All of the flux lands on some pixel.
TEST(SpotFit, TheModelHoldsItsFlux) {
  double sum = 0;
  for (int v = 0; v < 30; ++v) {
    for (int u = 0; u < 30; ++u) sum += spot_level({{14.2, 15.7}, 1.3, 500, 0}, u, v).level;
  }
  EXPECT_NEAR(sum, 500, 1e-9);
}

// Spots of all sizes and brightnesses, at any place within a pixel; 5.991 is the 95 % quantile of chi-square with two
// degrees of freedom.
TEST(Spots, CovarianceCoversTheError) {
  std::mt19937 random(4);
  std::uniform_real_distribution<double> within(-0.5, 0.5), widths(0.7, 2.0), peaks(60, 220);
  int inside = 0, count = 0;
  double squares = 0, squares_of_gravity = 0;
  for (int trial = 0; trial < 40; ++trial) {
    std::vector<SpotModel> truth;
    for (int i = 0; i < 20; ++i) {
      const double peak = peaks(random), width = widths(random);
      const double v = 30 + 50 * (i / 5) + within(random), u = 30 + 60 * (i % 5) + within(random);
      truth.push_back(made_spot(u, v, width, peak));
    }
    const SpotsFound found = find_spots(made_spot_image(truth, {}, random)).value();
    ASSERT_EQ(found.spots.size(), truth.size());
    for (const Spot& spot : found.spots) {
      for (const SpotModel& model : truth) {
        const Eigen::Vector2d error = spot.pixel - model.centre_px;
        if (error.norm() > 2) continue;
        ++count;
        inside += error.dot(spot.covariance_px2.inverse() * error) < 5.991;
        squares += error.squaredNorm() / 2;
        squares_of_gravity += (spot.centre_of_gravity_px - model.centre_px).squaredNorm() / 2;
      }
    }
  }
  ASSERT_EQ(count, 800);
  EXPECT_NEAR(inside / double(count), 0.95, 0.025);
  EXPECT_LT(std::sqrt(squares / count), 0.02);
  EXPECT_GT(squares_of_gravity, 2 * squares);
}

TEST(Spots, SaturatedPixelsAreLeftOut) {
  std::mt19937 random(8);
  std::uniform_real_distribution<double> within(-0.5, 0.5);
  for (int trial = 0; trial < 50; ++trial) {
    const double v = 50 + within(random), u = 40 + within(random);
    const SpotModel truth = made_spot(u, v, 1.5, 900);
    const SpotsFound found = find_spots(made_spot_image({truth}, {}, random)).value();
    ASSERT_EQ(found.spots.size(), 1u);
    EXPECT_GT(found.spots[0].saturated, 5);
    const Eigen::Vector2d error = found.spots[0].pixel - truth.centre_px;
    EXPECT_LT(error.norm(), 0.05);
    EXPECT_LT(error.dot(found.spots[0].covariance_px2.inverse() * error), 25);
  }
}

TEST(Spots, SixteenBitsAndAnUnevenBackground) {
  std::mt19937 random(3);
  const SpotModel truth = made_spot(100.3, 80.1, 1.2, 120);
  MadeImageOptions options;
  options.depth = CV_16U;
  cv::Mat image = made_spot_image({truth}, options, random);
  for (int y = 0; y < image.rows; ++y) {
    for (int x = 0; x < image.cols; ++x) {
      image.at<std::uint16_t>(y, x) = static_cast<std::uint16_t>(image.at<std::uint16_t>(y, x) + 60 * x);
    }
  }
  const SpotsFound found = find_spots(image).value();
  ASSERT_EQ(found.spots.size(), 1u);
  EXPECT_LT((found.spots[0].pixel - truth.centre_px).norm(), 0.05);
  EXPECT_NEAR(found.spots[0].width_px, 1.2, 0.03);
}

TEST(Spots, WhatIsNoSpotIsRefusedByName) {
  std::mt19937 random(6);
  const std::vector<SpotModel> models{made_spot(1.0, 60, 1.2, 150), made_spot(150, 60, 1.2, 150),
                                      made_spot(154.5, 60, 1.2, 150)};
  cv::Mat image = made_spot_image(models, {}, random);
  image.at<std::uint8_t>(200, 50) = 255;
  image(cv::Rect(200, 150, 40, 40)).setTo(255);
  for (int i = 0; i < 3; ++i) image(cv::Rect(80 + 4 * i, 150, 4, 4)).setTo(200);
  const SpotsFound found = find_spots(image).value();
  EXPECT_TRUE(found.spots.empty());
  std::vector<SpotRefusal> reasons;
  for (const RefusedSpot& refused : found.refused) reasons.push_back(refused.refusal);
  EXPECT_THAT(reasons,
              testing::UnorderedElementsAre(SpotRefusal::at_the_edge, SpotRefusal::elongated, SpotRefusal::elongated,
                                            SpotRefusal::hot_pixel, SpotRefusal::too_big));
}

TEST(Spots, NoImageIsASentence) {
  EXPECT_THAT(find_spots({}).error().message, HasSubstr("no image"));
  EXPECT_THAT(find_spots(cv::Mat(8, 8, CV_8UC3, cv::Scalar(0))).error().message, HasSubstr("grey"));
  EXPECT_TRUE(find_spots(cv::Mat(8, 8, CV_8U, cv::Scalar(0)))->spots.empty());
}

}  // namespace
}  // namespace crumple
