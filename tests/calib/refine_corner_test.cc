#include "calib/refine_corner.h"

#include <cmath>
#include <functional>
#include <random>

#include <gtest/gtest.h>

namespace crumple {
namespace {

// Intensity of a perfectly sharp scene at a point, px.
using Scene = std::function<double(const Eigen::Vector2d&)>;

// Two edges through `corner` along the steps; light squares 200, dark ones 40.
Scene checkers(const Eigen::Vector2d& corner, const Eigen::Vector2d& step_x, const Eigen::Vector2d& step_y) {
  return [=](const Eigen::Vector2d& p) {
    const Eigen::Vector2d d = p - corner;
    const double across_x = step_x.x() * d.y() - step_x.y() * d.x();
    const double across_y = step_y.x() * d.y() - step_y.y() * d.x();
    return across_x * across_y > 0 ? 200.0 : 40.0;
  };
}

// Seen through a Gaussian blur by square pixels: brute force over a fine grid, none of the model's error functions.
cv::Mat seen(const Scene& scene, double blur_px) {
  constexpr int kSize = 31, kPerPixel = 24;
  const int reach = static_cast<int>(std::ceil(kPerPixel * (0.5 + 4 * blur_px)));
  std::vector<double> weights;
  double sum = 0;
  for (int i = -reach; i <= reach; ++i) {
    const double x = static_cast<double>(i) / kPerPixel, root = std::sqrt(2.0) * blur_px;
    weights.push_back(std::erf((x + 0.5) / root) - std::erf((x - 0.5) / root));
    sum += weights.back();
  }
  cv::Mat image(kSize, kSize, CV_16U);
  for (int y = 0; y < kSize; ++y) {
    for (int x = 0; x < kSize; ++x) {
      double light = 0;
      for (int j = -reach; j <= reach; ++j) {
        for (int i = -reach; i <= reach; ++i) {
          const Eigen::Vector2d at(x + static_cast<double>(i) / kPerPixel, y + static_cast<double>(j) / kPerPixel);
          light +=
              weights[static_cast<std::size_t>(i + reach)] * weights[static_cast<std::size_t>(j + reach)] * scene(at);
        }
      }
      image.at<std::uint16_t>(y, x) = cv::saturate_cast<std::uint16_t>(100 * light / (sum * sum));
    }
  }
  return image;
}

cv::Mat with_noise(const cv::Mat& image, double sigma, unsigned seed) {
  std::mt19937 generator(seed);
  std::normal_distribution<double> normal;
  cv::Mat noisy = image.clone();
  for (auto& value : cv::Mat_<std::uint16_t>(noisy))
    value = cv::saturate_cast<std::uint16_t>(value + sigma * normal(generator));
  return noisy;
}

const Eigen::Vector2d kCorner(15.23, 14.81);
const Eigen::Vector2d kStepX(28, 6);
const Eigen::Vector2d kStepY(-9, 24);

TEST(RefineCorner, FindsTheCornerFromASecondPixelAway) {
  const cv::Mat image = seen(checkers(kCorner, kStepX, kStepY), 0.6);
  for (const Eigen::Vector2d& off : {Eigen::Vector2d(1.2, -0.7), Eigen::Vector2d(-0.9, 1.1), Eigen::Vector2d(0, 0)}) {
    const auto corner = refine_corner(image, kCorner + off, kStepX, kStepY);
    ASSERT_TRUE(corner);
    // The brute-force picture is sampled eight times a pixel.
    EXPECT_LT((corner->pixel - kCorner).norm(), 3e-3) << corner->pixel.transpose();
  }
}

// One per cent brighter per pixel. All that is left is
// the change of light within the blur: its variance times the logarithmic gradient, (0.36 + 1/12) x 0.01.
TEST(RefineCorner, ALightGradientMovesItByTheBlurOnly) {
  const Scene even = checkers(kCorner, kStepX, kStepY);
  const Scene lit = [&](const Eigen::Vector2d& p) { return even(p) * std::exp(0.01 * (p - kCorner).x()); };
  const auto corner = refine_corner(seen(lit, 0.6), kCorner, kStepX, kStepY);
  ASSERT_TRUE(corner);
  const Eigen::Vector2d by_the_blur(-0.0044, 0);
  EXPECT_LT((corner->pixel - kCorner - by_the_blur).norm(), 0.002) << (corner->pixel - kCorner).transpose();
}

TEST(RefineCorner, ACamerasGammaDoesNotMoveIt) {
  const Scene even = checkers(kCorner, kStepX, kStepY);
  cv::Mat image = seen(even, 0.7);
  for (auto& value : cv::Mat_<std::uint16_t>(image)) {
    value = cv::saturate_cast<std::uint16_t>(20000 * std::pow(value / 20000.0, 1 / 2.2));
  }
  const auto corner = refine_corner(image, kCorner, kStepX, kStepY);
  ASSERT_TRUE(corner);
  EXPECT_LT((corner->pixel - kCorner).norm(), 3e-3) << (corner->pixel - kCorner).transpose();
}

TEST(RefineCorner, ItsSigmaIsTheScatterOverNoise) {
  constexpr int kDraws = 100;
  const cv::Mat image = seen(checkers(kCorner, kStepX, kStepY), 0.6);
  double squares = 0, variance = 0;
  for (unsigned seed = 1; seed <= kDraws; ++seed) {
    const auto corner = refine_corner(with_noise(image, 800, seed), kCorner, kStepX, kStepY);
    ASSERT_TRUE(corner);
    squares += 0.5 * (corner->pixel - kCorner).squaredNorm() / kDraws;
    variance += corner->sigma_px * corner->sigma_px / kDraws;
  }
  // 200 coordinates know their own variance to 10 %.
  EXPECT_NEAR(squares / variance, 1, 0.3);
}

TEST(RefineCorner, RefusesWhatIsNoCorner) {
  const Scene edge = [](const Eigen::Vector2d& p) { return p.x() > 15.2 ? 200.0 : 40.0; };
  EXPECT_FALSE(refine_corner(seen(edge, 0.6), kCorner, kStepX, kStepY));
  EXPECT_FALSE(refine_corner(cv::Mat(31, 31, CV_8U, cv::Scalar(128)), kCorner, kStepX, kStepY));
  // Too near the image's border.
  EXPECT_FALSE(refine_corner(seen(checkers(kCorner, kStepX, kStepY), 0.6), {4, 4}, kStepX, kStepY));
}

}  // namespace
}  // namespace crumple
