#include <cmath>

#include <gtest/gtest.h>
#include <opencv2/core.hpp>

#include "datasets/render/sensor.h"

namespace crumple {
namespace {

Detector fine_detector() {
  Detector detector;
  detector.exposure = 1;
  detector.full_well_electrons = 20000;
  detector.read_noise_electrons = 9;
  detector.bits = 16;
  detector.offset = 0.02;
  return detector;
}

double electrons_per_code(const Detector& detector) {
  return 1 / (code_from_electrons(detector, 1) - code_from_electrons(detector, 0));
}

// 250,000 pixels: the variance is known to 0.3 % (one sigma), the mean to a fiftieth of the noise's hundredth.
TEST(RenderSensor, variance_is_shot_plus_read_noise) {
  const Detector detector = fine_detector();
  for (const double electrons : {0.0, 3.0, 30.0, 200.0, 2000.0, 15000.0}) {
    const cv::Mat1f radiance(500, 500, static_cast<float>(electrons / detector.full_well_electrons));
    cv::Scalar mean, deviation;
    cv::meanStdDev(expose(detector, radiance, 11), mean, deviation);
    const double variance = electrons + std::pow(detector.read_noise_electrons, 2);
    EXPECT_NEAR(std::pow(deviation[0] * electrons_per_code(detector), 2) / variance, 1, 0.015) << electrons;
    EXPECT_NEAR((mean[0] - code_from_electrons(detector, electrons)) * electrons_per_code(detector), 0,
                5 * std::sqrt(variance) / 500)
        << electrons;
  }
}

TEST(RenderSensor, bits_and_saturation) {
  Detector detector = fine_detector();
  detector.read_noise_electrons = 0;
  detector.shot_noise = false;
  cv::Mat1f radiance(1, 4097);
  for (int x = 0; x < radiance.cols; ++x) radiance(0, x) = static_cast<float>(x / 4000.0);
  for (const int bits : {8, 10, 12, 16}) {
    detector.bits = bits;
    const cv::Mat image = expose(detector, radiance, 1);
    EXPECT_EQ(image.depth(), bits == 8 ? CV_8U : CV_16U);
    double largest = 0;
    cv::minMaxLoc(image, nullptr, &largest);
    EXPECT_EQ(largest, saturation_code(detector));
    int steps = 0;
    const auto code = [&](int x) { return bits == 8 ? image.at<std::uint8_t>(0, x) : image.at<std::uint16_t>(0, x); };
    for (int x = 1; x < radiance.cols; ++x) steps += code(x) != code(x - 1);
    EXPECT_NEAR(steps, std::min(4000.0, 0.98 * ((1 << bits) - 1)), 3);
  }
}

TEST(RenderSensor, seed_decides_the_noise) {
  const Detector detector = fine_detector();
  const cv::Mat1f radiance(40, 40, 0.5F);
  EXPECT_EQ(cv::norm(expose(detector, radiance, 1), expose(detector, radiance, 1), cv::NORM_INF), 0);
  EXPECT_GT(cv::norm(expose(detector, radiance, 1), expose(detector, radiance, 2), cv::NORM_INF), 0);
}

}  // namespace
}  // namespace crumple
