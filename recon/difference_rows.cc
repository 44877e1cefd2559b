#include "recon/difference_rows.h"

#include <algorithm>

namespace crumple {

DifferenceRows::DifferenceRows(const StripeImages& images, const StripeStack& stack, const cv::Mat& contrast)
    : images_(images),
      stack_(stack),
      contrast_(contrast),
      row_(static_cast<std::size_t>(contrast.cols)),
      other_(row_),
      differences_(row_.size() * stack.patterns.size()) {}

void DifferenceRows::read(int y) {
  const std::size_t bits = stack_.patterns.size();
  for (std::size_t b = 0; b < bits; ++b) {
    read_row(stack_.patterns[b], y, row_);
    if (stack_.inverses.empty()) {
      read_row(images_.white, y, other_);
      const auto* contrast = contrast_.ptr<float>(y);
      // white + black - pattern, the inverse that was not taken
      for (std::size_t x = 0; x < row_.size(); ++x) other_[x] = 2 * other_[x] - contrast[x] - row_[x];
    } else {
      read_row(stack_.inverses[b], y, other_);
    }
    for (std::size_t x = 0; x < row_.size(); ++x) differences_[x * bits + b] = row_[x] - other_[x];
  }
}

std::span<const float> DifferenceRows::pixel(int x) const {
  const std::size_t bits = stack_.patterns.size();
  return std::span(differences_).subspan(static_cast<std::size_t>(x) * bits, bits);
}

BitVector DifferenceRows::bits(int x) const {
  BitVector v = BitVector::Zero();
  std::copy_n(pixel(x).begin(), stack_.patterns.size(), v.data());
  return v;
}

}  // namespace crumple
