#include "datasets/exposure_check.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <set>

#include <fmt/format.h>
#include <opencv2/core.hpp>

namespace crumple {
namespace {

using Kind = FrameContent::Kind;

constexpr double kDarkLevel = 0.02;
constexpr double kDarkShare = 0.001;  // of the pixels may be brighter in a dark frame
constexpr double kDimLevel = 0.10;
constexpr double kDimShare = 0.01;
constexpr double kSaturatedWarning = 0.01;
constexpr double kSaturatedError = 0.25;

double share_above(const cv::Mat& image, double level) {
  return cv::countNonZero(image > level) / static_cast<double>(image.total());
}

double largest_value(const cv::Mat& image) {
  double largest = 0;
  cv::minMaxLoc(image, nullptr, &largest);
  return largest;
}

// Data of 10, 12 and 14 bit shifted to the top of 16 clip here.
bool is_shifted_limit(double value) { return value == 65472 || value == 65520 || value == 65532; }

double saturated_share(const cv::Mat& image, double full_scale) {
  const double largest = largest_value(image);
  const double limit = is_shifted_limit(largest) ? largest : full_scale;
  return share_above(image, limit - 0.5);
}

// A stripe frame may be dark where the camera sees few stripes; whether it should be is the sequence's matter.
bool must_be_lit(Kind kind) { return kind != Kind::black && kind != Kind::stripes && kind != Kind::leds; }

}  // namespace

double full_scale_of(const std::vector<ShownFrame>& frames) {
  double largest = 0;
  bool deep = false;
  for (const ShownFrame& frame : frames) {
    if (frame.image.empty()) continue;
    deep = deep || frame.image.depth() == CV_16U;
    largest = std::max(largest, largest_value(frame.image));
  }
  if (!deep) return 255;
  for (const double limit : {1023.0, 4095.0, 16383.0}) {
    if (largest <= limit) return limit;
  }
  return 65535;
}

std::vector<Finding> check_exposure(const std::vector<ShownFrame>& frames, double full_scale,
                                    const std::string& where) {
  std::vector<Finding> findings;
  const ShownFrame* worst = nullptr;
  double worst_share = 0;
  int saturated_frames = 0;
  for (const ShownFrame& frame : frames) {
    if (frame.image.empty()) continue;
    const Kind kind = frame.content.kind;
    if (must_be_lit(kind) && share_above(frame.image, kDarkLevel * full_scale) < kDarkShare) {
      findings.push_back({Severity::error, where,
                          fmt::format("{} ({}) is dark: {:.4g} % of its pixels reach {:.0f} % of full scale; check the "
                                      "exposure and the lens cap",
                                      frame.name, frame_words(frame.content),
                                      100 * share_above(frame.image, kDarkLevel * full_scale), 100 * kDarkLevel)});
    } else if ((kind == Kind::white || kind == Kind::ambient) &&
               share_above(frame.image, kDimLevel * full_scale) < kDimShare) {
      findings.push_back({Severity::warning, where,
                          fmt::format("{} ({}) is dim: 99 % of its pixels stay below {:.0f} % of full scale; expose "
                                      "longer",
                                      frame.name, frame_words(frame.content), 100 * kDimLevel)});
    }
    const double share = saturated_share(frame.image, full_scale);
    saturated_frames += share >= kSaturatedWarning ? 1 : 0;
    if (share > worst_share) {
      worst_share = share;
      worst = &frame;
    }
  }
  if (saturated_frames > 0) {
    const std::string others =
        saturated_frames > 1 ? fmt::format(" ({} frames exceed {:.0f} %)", saturated_frames, 100 * kSaturatedWarning)
                             : "";
    findings.push_back({worst_share >= kSaturatedError ? Severity::error : Severity::warning, where,
                        fmt::format("{} ({}) is saturated in {:.1f} % of its pixels{}; expose shorter or stop down",
                                    worst->name, frame_words(worst->content), 100 * worst_share, others)});
  }
  return findings;
}

}  // namespace crumple
