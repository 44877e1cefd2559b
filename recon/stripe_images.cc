#include "recon/stripe_images.h"

#include <algorithm>

#include <fmt/format.h>
#include <opencv2/core.hpp>

namespace crumple {
namespace {

Expected<void> check_image(const cv::Mat& image, const cv::Mat& like, const std::string& name) {
  if (image.empty()) return fail(fmt::format("{} is missing: take or name it", name));
  if (image.type() != CV_8UC1 && image.type() != CV_16UC1) {
    return fail(fmt::format("{} is not a grey image of 8 or 16 bits: convert it", name));
  }
  if (image.size() != like.size() || image.type() != like.type()) {
    return fail(fmt::format("{} has another size or depth ({} x {}) than the white frame ({} x {})", name, image.cols,
                            image.rows, like.cols, like.rows));
  }
  return {};
}

Expected<void> check_stack(const StripeStack& stack, std::size_t index, const StripeImages& images) {
  const auto orientation = checked(stack.orientation, images.projector);
  if (!orientation) return fail(fmt::format("stripe orientation {}: {}", index, orientation.error().message));
  const auto bits = static_cast<std::size_t>(stack.orientation.bits);
  const std::size_t inverses = stack.orientation.inverse ? bits : 0;
  if (stack.patterns.size() != bits || stack.inverses.size() != inverses) {
    return fail(fmt::format("stripe orientation {} needs {} pattern and {} inverse frames but has {} and {}", index,
                            bits, inverses, stack.patterns.size(), stack.inverses.size()));
  }
  for (std::size_t b = 0; b < bits; ++b) {
    const auto name = [&](const char* kind) {
      return fmt::format("{} frame {} of stripe orientation {}", kind, b, index);
    };
    if (auto ok = check_image(stack.patterns[b], images.white, name("pattern")); !ok) return ok;
    if (inverses == 0) continue;
    if (auto ok = check_image(stack.inverses[b], images.white, name("inverse")); !ok) return ok;
  }
  return {};
}

}  // namespace

Expected<void> check_images(const StripeImages& images) {
  if (auto ok = check_image(images.white, images.white, "the white frame"); !ok) return ok;
  if (!images.black.empty()) {
    if (auto ok = check_image(images.black, images.white, "the black frame"); !ok) return ok;
  }
  if (images.stacks.empty()) return fail("there is no stripe orientation to decode: add at least one");
  for (std::size_t i = 0; i < images.stacks.size(); ++i) {
    if (auto ok = check_stack(images.stacks[i], i, images); !ok) return ok;
  }
  return {};
}

double full_range(const cv::Mat& image) { return image.depth() == CV_16U ? 65535 : 255; }

void read_row(const cv::Mat& image, int y, std::span<float> row) {
  if (image.depth() == CV_16U) {
    const auto* source = image.ptr<std::uint16_t>(y);
    std::transform(source, source + image.cols, row.begin(), [](std::uint16_t v) { return static_cast<float>(v); });
  } else {
    const auto* source = image.ptr<std::uint8_t>(y);
    std::transform(source, source + image.cols, row.begin(), [](std::uint8_t v) { return static_cast<float>(v); });
  }
}

cv::Mat contrast_image(const StripeImages& images) {
  cv::Mat dark = images.black;
  if (dark.empty()) {
    dark = images.white.clone();
    for (const StripeStack& stack : images.stacks) {
      for (const cv::Mat& image : stack.patterns) dark = cv::min(dark, image);
      for (const cv::Mat& image : stack.inverses) dark = cv::min(dark, image);
    }
  }
  cv::Mat contrast;
  cv::subtract(images.white, dark, contrast, cv::noArray(), CV_32F);
  return cv::max(contrast, 0);
}

}  // namespace crumple
