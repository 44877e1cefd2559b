#include "recon/patterns.h"

#include <bit>
#include <cmath>

#include <gtest/gtest.h>
#include <opencv2/core.hpp>
#include <rapidcheck/gtest.h>

namespace crumple {
namespace {

constexpr ImageSize kPanel{1024, 768};

StripeOrientation columns() { return {}; }
StripeOrientation rows() { return {.angle_rad = M_PI / 2}; }

TEST(Patterns, GrayCodesOfTheFirstEightNumbers) {
  const unsigned expected[] = {0b000, 0b001, 0b011, 0b010, 0b110, 0b111, 0b101, 0b100};
  for (unsigned i = 0; i < 8; ++i) EXPECT_EQ(gray_from_binary(i), expected[i]);
}

RC_GTEST_PROP(Patterns, GrayCodeRoundTripsAndChangesOneBit, ()) {
  const unsigned i = *rc::gen::inRange(0U, 1U << 17);
  RC_ASSERT(binary_from_gray(gray_from_binary(i)) == i);
  RC_ASSERT(std::popcount(gray_from_binary(i) ^ gray_from_binary(i + 1)) == 1);
}

TEST(Patterns, ColumnsAndRowsStartAtThePanelsEdge) {
  EXPECT_EQ(stripe_origin_px(columns(), kPanel), -0.5);
  EXPECT_EQ(stripe_origin_px(rows(), kPanel), -0.5);
  EXPECT_EQ(stripe_count(columns(), kPanel), 1024);
  EXPECT_EQ(stripe_count(rows(), kPanel), 768);
}

TEST(Patterns, DiagonalStripesSpanTheDiagonal) {
  const StripeOrientation diagonal{.angle_rad = M_PI / 4, .stripe_width_px = 2};
  EXPECT_NEAR(stripe_origin_px(diagonal, kPanel), -M_SQRT1_2, 1e-12);
  EXPECT_EQ(stripe_count(diagonal, kPanel), static_cast<int>(std::ceil((1024 + 768) * M_SQRT1_2 / 2)));
}

TEST(Patterns, MostSignificantBitOfColumnsLightsTheRightHalf) {
  const cv::Mat image = draw_stripes(columns(), kPanel, 0, false);
  EXPECT_EQ(image.at<std::uint8_t>(300, 511), 0);
  EXPECT_EQ(image.at<std::uint8_t>(300, 512), 255);
  EXPECT_EQ(cv::countNonZero(image), 512 * 768);
}

TEST(Patterns, LeastSignificantBitIsTwoStripesWideFromTheFirst) {
  const cv::Mat image = draw_stripes(columns(), kPanel, 9, false);
  for (int x = 0; x < kPanel.width_px; ++x) EXPECT_EQ(image.at<std::uint8_t>(7, x) != 0, x % 4 == 1 || x % 4 == 2);
}

TEST(Patterns, RowsAreColumnsTransposed) {
  const cv::Mat column_image = draw_stripes(columns(), {64, 64}, 8, false);
  const cv::Mat row_image = draw_stripes(rows(), {64, 64}, 8, false);
  EXPECT_EQ(cv::countNonZero(column_image.t() != row_image), 0);
}

TEST(Patterns, ChecksRefuseWhatCannotBeDecoded) {
  EXPECT_TRUE(checked(columns(), kPanel));
  EXPECT_FALSE(checked({.bits = 9}, kPanel));
  EXPECT_TRUE(checked({.stripe_width_px = 2, .bits = 9}, kPanel));
  EXPECT_FALSE(checked({.code_offset = 1}, kPanel));
  EXPECT_FALSE(checked({.bits = 17}, kPanel));
  EXPECT_FALSE(checked({.bits = 0}, kPanel));
  EXPECT_FALSE(checked({.stripe_width_px = 0}, kPanel));
  EXPECT_FALSE(checked({.stripe_width_px = 1e-12, .bits = 16}, kPanel));
  EXPECT_FALSE(checked({.angle_rad = NAN}, kPanel));
  EXPECT_FALSE(checked({.angle_rad = M_PI / 4}, kPanel));
  EXPECT_FALSE(checked(columns(), {0, 768}));
}

RC_GTEST_PROP(Patterns, EveryPixelShowsItsStripesCode, ()) {
  const ImageSize panel{*rc::gen::inRange(1, 80), *rc::gen::inRange(1, 80)};
  const StripeOrientation orientation{.angle_rad = *rc::gen::inRange(-3600, 3600) * 0.1 * M_PI / 180,
                                      .stripe_width_px = *rc::gen::inRange(5, 60) * 0.1,
                                      .bits = 9,
                                      .code_offset = *rc::gen::inRange(0, 100)};
  RC_ASSERT(static_cast<bool>(checked(orientation, panel)));
  std::vector<cv::Mat> bits;
  for (int b = 0; b < orientation.bits; ++b) {
    bits.push_back(draw_stripes(orientation, panel, b, false));
    RC_ASSERT(cv::countNonZero(bits.back() == draw_stripes(orientation, panel, b, true)) == 0);
  }
  const int count = stripe_count(orientation, panel);
  const double origin = stripe_origin_px(orientation, panel);
  for (int y = 0; y < panel.height_px; ++y) {
    for (int x = 0; x < panel.width_px; ++x) {
      unsigned gray = 0;
      for (const cv::Mat& bit : bits) gray = gray << 1 | (bit.at<std::uint8_t>(y, x) ? 1U : 0U);
      const int stripe = static_cast<int>(binary_from_gray(gray)) - orientation.code_offset;
      RC_ASSERT(stripe >= 0 && stripe < count);
      const double s = orientation.normal().dot(Eigen::Vector2d(x, y));
      RC_ASSERT(std::abs(s - origin - (stripe + 0.5) * orientation.stripe_width_px) <=
                0.5 * orientation.stripe_width_px + 1e-9);
    }
  }
}

}  // namespace
}  // namespace crumple
