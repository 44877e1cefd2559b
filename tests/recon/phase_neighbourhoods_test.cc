#include "recon/phase_neighbourhoods.h"

#include <cmath>
#include <random>

#include <gtest/gtest.h>
#include <opencv2/core.hpp>

namespace crumple {
namespace {

constexpr int kAcross = 60;
constexpr double kScatter = 0.05;

double plane(int x, int y) { return 20 + 1.03 * x - 0.2 * y; }

struct Coordinates {
  cv::Mat u = cv::Mat(kAcross, kAcross, CV_64F, cv::Scalar(0));
  cv::Mat sigma = cv::Mat(kAcross, kAcross, CV_32F, cv::Scalar(0));
};

Coordinates noisy_plane() {
  Coordinates made;
  std::mt19937 random(3);
  std::normal_distribution<double> draw(0, kScatter);
  for (int y = 0; y < kAcross; ++y) {
    for (int x = 0; x < kAcross; ++x) made.u.at<double>(y, x) = plane(x, y) + draw(random);
  }
  made.sigma = static_cast<float>(kScatter);
  return made;
}

TEST(PhaseNeighbourhoods, KnowAPlaneBetterThanAPixelDoes) {
  Coordinates made = noisy_plane();
  // A hole, so that some pixels have the plane through what is left.
  made.sigma(cv::Rect(20, 20, 6, 9)) = 0;
  const PhaseNeighbourhoods found = phase_neighbourhoods(made.u, made.sigma);
  double squares = 0, count = 0;
  for (int y = 0; y < kAcross; ++y) {
    for (int x = 0; x < kAcross; ++x) {
      if (made.sigma.at<float>(y, x) <= 0) {
        EXPECT_EQ(found.sigma.at<float>(y, x), 0);
        continue;
      }
      ASSERT_GT(found.sigma.at<float>(y, x), 0);
      squares += std::pow(found.u.at<double>(y, x) - plane(x, y), 2);
      ++count;
      EXPECT_NEAR(found.slopes.at<cv::Vec2f>(y, x)[0], 1.03, 0.05);
      EXPECT_NEAR(found.slopes.at<cv::Vec2f>(y, x)[1], -0.2, 0.05);
    }
  }
  EXPECT_LT(std::sqrt(squares / count), 0.3 * kScatter);
}

TEST(PhaseNeighbourhoods, SayNothingOfAPixelThatIsAlone) {
  Coordinates made = noisy_plane();
  made.sigma = 0;
  made.sigma.at<float>(30, 30) = 0.05F;
  EXPECT_EQ(phase_neighbourhoods(made.u, made.sigma).sigma.at<float>(30, 30), 0);
}

}  // namespace
}  // namespace crumple
