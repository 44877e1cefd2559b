// Against a real capture kept beside the project; skipped where it is missing.
#include <cstdlib>
#include <filesystem>
#include <string>

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include "recon/stripe_phase.h"

namespace crumple {
namespace {

std::filesystem::path procam() {
  const char* data = std::getenv("CRUMPLE_DATA");
  return std::filesystem::path(data != nullptr ? data : CRUMPLE_SOURCE_DIR "/../shared/data") / "procam";
}

cv::Mat frame(const std::string& name, int k) {
  return cv::imread((procam() / fmt::format(fmt::runtime(name), k)).string(), cv::IMREAD_GRAYSCALE);
}

StripeOrientation orientation(int axis) { return {.angle_rad = axis * M_PI / 2}; }

TEST(RealPatterns, DrawnStripesAreThoseThatWereProjected) {
  if (!std::filesystem::exists(procam())) GTEST_SKIP() << procam() << " is missing; set CRUMPLE_DATA";
  for (int k = 0; k < 40; ++k) {
    const cv::Mat projected = frame("graycode_pattern/pattern_{:02d}.png", k);
    const cv::Mat drawn = draw_stripes(orientation(k / 20), {1024, 768}, k % 20 / 2, k % 2 == 1);
    EXPECT_EQ(cv::countNonZero(projected != drawn), 0) << "frame " << k;
  }
}

TEST(RealPatterns, NineteenOfTwentyLitPixelsGetACoordinateWithSmallSigma) {
  if (!std::filesystem::exists(procam())) GTEST_SKIP() << procam() << " is missing; set CRUMPLE_DATA";
  const auto capture = [](int k) { return frame("capture_4/graycode_{:02d}.png", k); };
  StripeImages images{.projector = {1024, 768}, .stacks = {}, .white = {}, .black = {}};
  images.white = cv::max(capture(40), capture(41));
  images.black = cv::min(capture(40), capture(41));
  StripeStack rows{.orientation = orientation(1), .patterns = {}, .inverses = {}};
  for (int b = 0; b < 10; ++b) {
    rows.patterns.push_back(capture(20 + 2 * b));
    rows.inverses.push_back(capture(21 + 2 * b));
  }
  images.stacks.push_back(rows);
  // On the board.
  const cv::Mat lit = lit_mask(images, {.lit_contrast = 0.16}) & (images.white > 80);
  const StripeCoordinates found = estimate_stripe_phase(images, 0, *decode_stripes(images, 0, lit, {}), {});
  EXPECT_GT(cv::countNonZero(found.sigma_px > 0), 0.95 * cv::countNonZero(lit));
  EXPECT_GT(cv::countNonZero((found.sigma_px > 0) & (found.sigma_px < 0.05)), 0.8 * cv::countNonZero(lit));
}

}  // namespace
}  // namespace crumple
