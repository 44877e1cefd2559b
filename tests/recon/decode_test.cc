#include "recon/decode.h"

#include <cmath>

#include <gtest/gtest.h>
#include <opencv2/core.hpp>
#include <opencv2/core/utility.hpp>
#include <rapidcheck/gtest.h>

#include "tests/recon/synthetic_stripes.h"

namespace crumple {
namespace {

// The camera sees the panel itself, dimmed.
StripeImages panel_images(const StripeOrientation& orientation, ImageSize panel, int type = CV_8U) {
  const double scale = type == CV_16U ? 150 : 0.6;
  const auto seen = [&](const cv::Mat& image) {
    cv::Mat dimmed;
    image.convertTo(dimmed, type, scale, 20 * scale);
    return dimmed;
  };
  const cv::Mat white(panel.height_px, panel.width_px, CV_8U, cv::Scalar(255));
  StripeImages images{.projector = panel, .stacks = {}, .white = seen(white), .black = seen(0 * white)};
  StripeStack stack{.orientation = orientation, .patterns = {}, .inverses = {}};
  for (int b = 0; b < orientation.bits; ++b) {
    stack.patterns.push_back(seen(draw_stripes(orientation, panel, b, false)));
    if (orientation.inverse) stack.inverses.push_back(seen(draw_stripes(orientation, panel, b, true)));
  }
  images.stacks.push_back(stack);
  return images;
}

cv::Mat everywhere(const StripeImages& images) { return cv::Mat(images.white.size(), CV_8U, cv::Scalar(255)); }

RC_GTEST_PROP(Decode, DrawnStripesAreReadBackByEveryRule, ()) {
  const ImageSize panel{*rc::gen::inRange(8, 70), *rc::gen::inRange(8, 70)};
  const StripeOrientation orientation{.angle_rad = *rc::gen::inRange(0, 360) * M_PI / 180,
                                      .stripe_width_px = *rc::gen::inRange(8, 40) * 0.1,
                                      .bits = 8,
                                      .code_offset = *rc::gen::inRange(0, 60)};
  const StripeImages images = panel_images(orientation, panel, *rc::gen::element(CV_8U, CV_16U));
  RC_ASSERT(static_cast<bool>(check_images(images)));
  const double origin = stripe_origin_px(orientation, panel);
  for (const BitRule rule : {BitRule::paper, BitRule::inverse, BitRule::half}) {
    const auto decoded = decode_stripes(images, 0, everywhere(images), {.bit_rule = rule});
    RC_ASSERT(static_cast<bool>(decoded));
    for (int y = 0; y < panel.height_px; ++y) {
      for (int x = 0; x < panel.width_px; ++x) {
        const double s = orientation.normal().dot(Eigen::Vector2d(x, y));
        const auto stripe = static_cast<int>(std::floor((s - origin) / orientation.stripe_width_px));
        RC_ASSERT(decoded->stripe.at<int>(y, x) == stripe);
      }
    }
  }
}

RC_GTEST_PROP(Decode, BytesAndWordsOfTheSameImagesAgree, ()) {
  StripeImages bytes = panel_images({.bits = 6}, {*rc::gen::inRange(3, 60), 4});
  cv::RNG random(*rc::gen::inRange(1, 1000));
  StripeImages words = bytes;
  const auto fill = [&](cv::Mat& image, cv::Mat& wide) {
    image = image.clone();
    random.fill(image, cv::RNG::UNIFORM, 0, 256);
    image.convertTo(wide, CV_16U);
  };
  fill(bytes.white, words.white);
  fill(bytes.black, words.black);
  for (std::size_t b = 0; b < bytes.stacks[0].patterns.size(); ++b) {
    fill(bytes.stacks[0].patterns[b], words.stacks[0].patterns[b]);
    fill(bytes.stacks[0].inverses[b], words.stacks[0].inverses[b]);
  }
  const auto narrow = decode_stripes(bytes, 0, everywhere(bytes), {});
  const auto wide = decode_stripes(words, 0, everywhere(words), {});
  RC_ASSERT(narrow && wide);
  RC_ASSERT(cv::countNonZero(narrow->stripe != wide->stripe) == 0);
  RC_ASSERT(cv::countNonZero(narrow->weakest_margin != wide->weakest_margin) == 0);
}

TEST(Decode, MarginIsTheSmallestDistanceFromFlipping) {
  StripeImages images = panel_images({.bits = 6}, {64, 8});
  images.stacks[0].patterns[2].at<std::uint8_t>(3, 40) = 55;
  images.stacks[0].inverses[2].at<std::uint8_t>(3, 40) = 50;
  const auto decoded = decode_stripes(images, 0, everywhere(images), {});
  ASSERT_TRUE(decoded);
  EXPECT_FLOAT_EQ(decoded->weakest_margin.at<float>(3, 40), 5);
  EXPECT_FLOAT_EQ(decoded->weakest_margin.at<float>(3, 41), 153);
}

TEST(Decode, UnlitAndImpossibleCodesAreNotDecoded) {
  StripeImages images = panel_images({.bits = 7}, {100, 8});
  images.white.at<std::uint8_t>(2, 30) = images.black.at<std::uint8_t>(2, 30);
  // All bits one below the first is Gray 1000000, stripe 127 of 100.
  images.stacks[0].patterns[0].at<std::uint8_t>(4, 0) = 165;
  images.stacks[0].inverses[0].at<std::uint8_t>(4, 0) = 12;
  const cv::Mat lit = lit_mask(images, {});
  const auto decoded = decode_stripes(images, 0, lit, {});
  ASSERT_TRUE(decoded);
  EXPECT_EQ(decoded->stripe.at<int>(2, 30), -1);
  EXPECT_EQ(decoded->stripe.at<int>(4, 0), -1);
  EXPECT_EQ(cv::countNonZero(decoded->stripe >= 0), 100 * 8 - 2);
}

TEST(Decode, MixedPixelsAreLeftOutOfTheMask) {
  StripeImages images = panel_images({.bits = 5}, {32, 8});
  images.white.colRange(16, 32) = 60;  // a darker half
  images.white.col(16) = 70;
  const cv::Mat lit = lit_mask(images, {.lit_contrast = 0.05, .mixed_ratio = 0.5});
  EXPECT_EQ(lit.at<std::uint8_t>(4, 15), 255);
  EXPECT_EQ(lit.at<std::uint8_t>(4, 16), 0);
  EXPECT_EQ(lit.at<std::uint8_t>(4, 20), 255);
}

TEST(Decode, RulesSayWhichFramesTheyMiss) {
  StripeImages images = panel_images({.bits = 5, .inverse = false}, {32, 8});
  EXPECT_FALSE(decode_stripes(images, 0, everywhere(images), {.bit_rule = BitRule::inverse}));
  EXPECT_TRUE(decode_stripes(images, 0, everywhere(images), {.bit_rule = BitRule::half}));
  images.black = cv::Mat();
  const auto missing = decode_stripes(images, 0, everywhere(images), {.bit_rule = BitRule::half});
  ASSERT_FALSE(missing);
  EXPECT_NE(missing.error().message.find("black"), std::string::npos);
}

TEST(Decode, ImagesThatDoNotFitAreNamed) {
  StripeImages images = panel_images({.bits = 5}, {32, 8});
  EXPECT_TRUE(check_images(images));
  StripeImages other = images;
  other.stacks[0].inverses[3] = cv::Mat(8, 31, CV_8U);
  const auto wrong = check_images(other);
  ASSERT_FALSE(wrong);
  EXPECT_NE(wrong.error().message.find("inverse frame 3"), std::string::npos);
  other = images;
  other.stacks[0].patterns.pop_back();
  EXPECT_FALSE(check_images(other));
  other = images;
  other.white = cv::Mat();
  EXPECT_FALSE(check_images(other));
  other = images;
  other.black = cv::Mat(8, 32, CV_16U);
  EXPECT_FALSE(check_images(other));
}

}  // namespace
}  // namespace crumple
