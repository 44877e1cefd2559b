#include "datasets/pattern_files.h"

#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <opencv2/imgcodecs.hpp>

#include "datasets/capture.h"
#include "tests/temporary_folder.h"

namespace crumple {
namespace {

constexpr ImageSize kPanelSize{64, 48};

TEST(PatternFiles, FewestBits) {
  EXPECT_EQ(sufficient_bits({}, {1024, 768}).value(), 10);
  EXPECT_EQ(sufficient_bits({}, {1025, 768}).value(), 11);
  EXPECT_EQ(sufficient_bits({.code_offset = 1}, {1024, 768}).value(), 11);
  EXPECT_EQ(sufficient_bits({.stripe_width_px = 2000}, {1024, 768}).value(), 1);
  EXPECT_FALSE(sufficient_bits({.stripe_width_px = 0.001}, {1024, 768}));
}

TEST(PatternFiles, FilesSortInTheOrderOfTheFrames) {
  const TemporaryFolder home;
  const std::vector<StripeOrientation> orientations = {{.bits = 6},
                                                       {.angle_rad = M_PI / 3, .bits = 7, .inverse = false}};
  const auto names = write_patterns(home.path(), orientations, kPanelSize, {});
  ASSERT_TRUE(names) << names.error().message;
  ASSERT_EQ(names->size(), 2U + 12U + 7U);
  EXPECT_TRUE(std::is_sorted(names->begin(), names->end()));
  EXPECT_EQ((*names)[3], "03_0deg_bit0_inverse.png");
  EXPECT_EQ(names->back(), "20_60deg_bit6.png");
  const cv::Mat image = cv::imread((home / names->back()).string(), cv::IMREAD_UNCHANGED);
  const cv::Mat drawn = draw_stripes(orientations[1], kPanelSize, 6, false);
  ASSERT_EQ(image.type(), CV_8UC1);
  EXPECT_EQ(cv::norm(image, drawn, cv::NORM_INF), 0);
}

TEST(PatternFiles, TheDescriptionIsWhatACaptureTakes) {
  const TemporaryFolder home;
  const std::vector<StripeOrientation> orientations = {{.bits = 6},
                                                       {.angle_rad = M_PI / 3, .bits = 7, .inverse = false}};
  ASSERT_TRUE(write_patterns(home.path(), orientations, kPanelSize, {}));
  std::string text = content_of(home / "patterns.yaml");
  const std::string camera =
      "sensors:\n  cam: {kind: camera, size_px: [100, 80], files: \"{station}_{frame:02}.png\"}\n";
  text.replace(text.find("sensors:\n"), 9, camera);
  write_content(home / "capture.yaml", "schema: crumple-capture/1\ntitle: Test\nstations: [a]\n" + text);
  const auto capture = read_capture(home / "capture.yaml");
  ASSERT_TRUE(capture) << capture.error().message;
  ASSERT_EQ(capture->orientations.size(), 2U);
  EXPECT_NEAR(capture->orientations[1].angle_rad, M_PI / 3, 1e-15);
  EXPECT_EQ(capture->orientations[1].bits, 7);
  EXPECT_FALSE(capture->orientations[1].inverse);
  const std::vector<FrameContent> drawn = pattern_sequence(orientations);
  ASSERT_EQ(capture->frames.size(), drawn.size());
  for (std::size_t i = 0; i < drawn.size(); ++i) {
    EXPECT_EQ(capture->frames[i].kind, drawn[i].kind) << i;
    EXPECT_EQ(capture->frames[i].orientation, drawn[i].orientation) << i;
    EXPECT_EQ(capture->frames[i].bit, drawn[i].bit) << i;
    EXPECT_EQ(capture->frames[i].inverted, drawn[i].inverted) << i;
  }
}

}  // namespace
}  // namespace crumple
