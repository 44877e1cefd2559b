#include "recon/stripe_edges.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

#include "recon/difference_rows.h"
#include "recon/noise_model.h"

namespace crumple {
namespace {

// Scatter over the bits of pattern + inverse on every seventh row, each frame's mean over the row taken out (the lamp).
NoiseModel noise_of_sums(const StripeStack& stack, const cv::Mat& contrast, const DecodedStripes& decoded) {
  const std::size_t bits = stack.inverses.size();
  std::vector<NoiseModel::Sample> samples;
  const auto width = static_cast<std::size_t>(contrast.cols);
  std::vector<float> pattern(width), inverse(width);
  for (int y = 3; bits >= 3 && y < contrast.rows; y += 7) {
    std::vector<int> columns;
    for (int x = 0; x < contrast.cols; ++x) {
      if (decoded.stripe.at<int>(y, x) >= 0) columns.push_back(x);
    }
    if (columns.size() < 10) continue;
    Eigen::ArrayXXd sums(static_cast<Eigen::Index>(bits), static_cast<Eigen::Index>(columns.size()));
    for (std::size_t b = 0; b < bits; ++b) {
      read_row(stack.patterns[b], y, pattern);
      read_row(stack.inverses[b], y, inverse);
      for (std::size_t i = 0; i < columns.size(); ++i) {
        const auto x = static_cast<std::size_t>(columns[i]);
        sums(static_cast<Eigen::Index>(b), static_cast<Eigen::Index>(i)) = pattern[x] + inverse[x];
      }
    }
    sums.colwise() -= sums.rowwise().mean().eval();
    sums.rowwise() -= sums.colwise().mean().eval();
    const Eigen::ArrayXd squares = sums.square().colwise().sum() / (static_cast<double>(bits) - 1);
    for (std::size_t i = 0; i < columns.size(); ++i) {
      samples.push_back({contrast.at<float>(y, columns[i]), static_cast<float>(squares[static_cast<Eigen::Index>(i)])});
    }
  }
  return NoiseModel(std::move(samples), std::max(1.0, static_cast<double>(bits) - 1));
}

class EdgeFinder {
 public:
  EdgeFinder(const StripeImages& images, const StripeStack& stack, const DecodedStripes& decoded,
             const StripeEdgeOptions& options)
      : stack_(stack),
        decoded_(decoded),
        options_(options),
        contrast_(contrast_image(images)),
        noise_(noise_of_sums(stack, contrast_, decoded)),
        rows_{DifferenceRows(images, stack, contrast_), DifferenceRows(images, stack, contrast_)},
        origin_px_(stripe_origin_px(stack.orientation, images.projector)) {}

  std::vector<StripeCrossing> run() {
    DifferenceRows* upper = &rows_[0];
    DifferenceRows* lower = &rows_[1];
    upper->read(0);
    for (int y = 0; y < contrast_.rows; ++y) {
      const bool has_lower = y + 1 < contrast_.rows;
      if (has_lower) lower->read(y + 1);
      for (int x = 0; x < contrast_.cols; ++x) {
        if (decoded_.stripe.at<int>(y, x) < 0) continue;
        if (x + 1 < contrast_.cols) visit({x, y}, {x + 1, y}, upper->pixel(x), upper->pixel(x + 1));
        if (has_lower) visit({x, y}, {x, y + 1}, upper->pixel(x), lower->pixel(x));
      }
      std::swap(upper, lower);
    }
    return std::move(crossings_);
  }

 private:
  void visit(cv::Point p, cv::Point q, std::span<const float> differences_p, std::span<const float> differences_q) {
    const int kp = decoded_.stripe.at<int>(p);
    const int kq = decoded_.stripe.at<int>(q);
    if (kq < 0 || std::abs(kp - kq) != 1) return;
    const double cp = contrast_.at<float>(p);
    const double cq = contrast_.at<float>(q);
    if (std::max(cp, cq) > options_.contrast_ratio * std::min(cp, cq)) return;

    const StripeOrientation& o = stack_.orientation;
    const auto gray = [&](int k) { return gray_from_binary(static_cast<unsigned>(k + o.code_offset)); };
    const int changed = std::countr_zero(gray(kp) ^ gray(kq));
    const auto bit = static_cast<std::size_t>(o.bits - 1 - changed);
    const double dp = differences_p[bit] / cp;
    const double dq = differences_q[bit] / cq;
    if (!(dp * dq <= 0) || dp == dq) return;

    const double t = dp / (dp - dq);
    const double variance_p = noise_.variance(cp) / (cp * cp);
    const double variance_q = noise_.variance(cq) / (cq * cq);
    const double sigma = std::sqrt((1 - t) * (1 - t) * variance_p + t * t * variance_q) / std::abs(dp - dq);
    if (sigma > options_.max_sigma_px) return;
    const Eigen::Vector2d direction(q.x - p.x, q.y - p.y);
    crossings_.push_back({.camera_pixel = Eigen::Vector2d(p.x, p.y) + t * direction,
                          .direction = direction,
                          .coordinate_px = origin_px_ + std::max(kp, kq) * o.stripe_width_px,
                          .sigma_px = sigma});
  }

  const StripeStack& stack_;
  const DecodedStripes& decoded_;
  const StripeEdgeOptions& options_;
  cv::Mat contrast_;
  NoiseModel noise_;
  std::array<DifferenceRows, 2> rows_;
  double origin_px_;
  std::vector<StripeCrossing> crossings_;
};

}  // namespace

std::vector<StripeCrossing> find_stripe_edges(const StripeImages& images, std::size_t stack,
                                              const DecodedStripes& decoded, const StripeEdgeOptions& options) {
  return EdgeFinder(images, images.stacks[stack], decoded, options).run();
}

}  // namespace crumple
