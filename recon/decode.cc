#include "recon/decode.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <fmt/format.h>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

namespace crumple {
namespace {

// Pattern minus `reference` is positive where the bit is one, by as much as the rule's margin.
void reference_row(const StripeImages& images, const StripeStack& stack, std::size_t bit, int y,
                   const DecodeOptions& options, std::span<float> reference, std::span<float> scratch) {
  switch (options.bit_rule) {
    case BitRule::inverse:
      read_row(stack.inverses[bit], y, reference);
      return;
    case BitRule::paper: {
      read_row(images.white, y, reference);
      const auto threshold = static_cast<float>(options.paper_threshold * full_range(images.white));
      for (float& r : reference) r -= threshold;
      return;
    }
    case BitRule::half:
      read_row(images.white, y, reference);
      read_row(images.black, y, scratch);
      for (std::size_t x = 0; x < reference.size(); ++x) reference[x] = 0.5F * (reference[x] + scratch[x]);
      return;
  }
}

// Patterns against their inverses in bytes, as nearly all cameras give them: the same result as in floats, but the
// compiler handles sixteen pixels at once.
void decode_bytes(const StripeStack& stack, int y, std::span<std::uint16_t> code, std::span<std::uint8_t> margin) {
  std::fill(code.begin(), code.end(), std::uint16_t{0});
  std::fill(margin.begin(), margin.end(), std::uint8_t{255});
  for (std::size_t b = 0; b < stack.patterns.size(); ++b) {
    const auto* const pattern = stack.patterns[b].ptr<std::uint8_t>(y);
    const auto* const inverse = stack.inverses[b].ptr<std::uint8_t>(y);
    std::uint16_t* const codes = code.data();
    std::uint8_t* const margins = margin.data();
    for (std::size_t x = 0; x < code.size(); ++x) {
      const std::uint8_t p = pattern[x], q = inverse[x];
      const std::uint8_t d = p > q ? static_cast<std::uint8_t>(p - q) : static_cast<std::uint8_t>(q - p);
      margins[x] = std::min(margins[x], d);
      const auto one = static_cast<std::uint16_t>(p > q);
      codes[x] = static_cast<std::uint16_t>((codes[x] << 1) | (one ^ (codes[x] & 1)));
    }
  }
}

class RowDecoder {
 public:
  RowDecoder(const StripeImages& images, const StripeStack& stack, const DecodeOptions& options)
      : images_(images),
        stack_(stack),
        options_(options),
        count_(stripe_count(stack.orientation, images.projector)),
        bytes_(options.bit_rule == BitRule::inverse && images.white.depth() == CV_8U),
        codes_(static_cast<std::size_t>(images.white.cols)),
        margins_(codes_.size()),
        pattern_(codes_.size()),
        reference_(pattern_.size()),
        scratch_(pattern_.size()) {}

  void decode(int y, const std::uint8_t* lit, int* stripe, float* margin) {
    const std::size_t width = pattern_.size();
    if (bytes_) {
      decode_bytes(stack_, y, codes_, margins_);
      std::copy(codes_.begin(), codes_.end(), stripe);
      std::copy(margins_.begin(), margins_.end(), margin);
    } else {
      decode_floats(y, stripe, margin);
    }
    const int offset = stack_.orientation.code_offset;
    for (std::size_t x = 0; x < width; ++x) {
      const int k = stripe[x] - offset;
      stripe[x] = lit[x] != 0 && k >= 0 && k < count_ ? k : -1;
    }
  }

 private:
  void decode_floats(int y, int* stripe, float* margin) {
    const std::size_t width = pattern_.size();
    std::fill_n(stripe, width, 0);
    std::fill_n(margin, width, std::numeric_limits<float>::max());
    for (std::size_t b = 0; b < stack_.patterns.size(); ++b) {
      read_row(stack_.patterns[b], y, pattern_);
      reference_row(images_, stack_, b, y, options_, reference_, scratch_);
      for (std::size_t x = 0; x < width; ++x) {
        const float d = pattern_[x] - reference_[x];
        // The binary code's next digit is the Gray digit xor the digit before it.
        stripe[x] = (stripe[x] << 1) | ((d > 0 ? 1 : 0) ^ (stripe[x] & 1));
        margin[x] = std::min(margin[x], std::abs(d));
      }
    }
  }

  const StripeImages& images_;
  const StripeStack& stack_;
  const DecodeOptions& options_;
  int count_;
  bool bytes_;
  std::vector<std::uint16_t> codes_;
  std::vector<std::uint8_t> margins_;
  std::vector<float> pattern_, reference_, scratch_;
};

}  // namespace

cv::Mat lit_mask(const StripeImages& images, const DecodeOptions& options) {
  const cv::Mat contrast = contrast_image(images);
  cv::Mat brightest;
  cv::dilate(contrast, brightest, cv::getStructuringElement(cv::MORPH_RECT, {5, 5}));
  cv::Mat unmixed = contrast >= options.mixed_ratio * brightest;
  return (contrast >= options.lit_contrast * full_range(images.white)) & unmixed;
}

Expected<DecodedStripes> decode_stripes(const StripeImages& images, std::size_t stack_index, const cv::Mat& lit,
                                        const DecodeOptions& options) {
  const StripeStack& stack = images.stacks[stack_index];
  if (options.bit_rule == BitRule::inverse && stack.inverses.empty()) {
    return fail(fmt::format(
        "stripe orientation {} has no inverse frames: decode it against half the white and black frames", stack_index));
  }
  if (options.bit_rule == BitRule::half && images.black.empty()) {
    return fail("there is no black frame to decode against: take one, or use inverse frames");
  }
  DecodedStripes decoded{cv::Mat(images.white.size(), CV_32S), cv::Mat(images.white.size(), CV_32F)};
  cv::parallel_for_({0, images.white.rows}, [&](const cv::Range& rows) {
    RowDecoder decoder(images, stack, options);
    for (int y = rows.start; y < rows.end; ++y) {
      decoder.decode(y, lit.ptr<std::uint8_t>(y), decoded.stripe.ptr<int>(y), decoded.weakest_margin.ptr<float>(y));
    }
  });
  return decoded;
}

}  // namespace crumple
