#include "recon/stripe_phase.h"

#include <algorithm>
#include <cmath>

#include <opencv2/core.hpp>

#include "recon/blur_fit.h"

namespace crumple {
namespace {

// Some hundreds per tile of the blur's map; more only costs time.
constexpr std::size_t kBlurSample = 20000;
constexpr double kReach = 2;  // stripes around the decoded one
constexpr std::size_t kGainClasses = 8;

// Reads pattern - inverse, or 2 pattern - white - black where there are no inverses, pixel by pixel: all bits of a
// pixel lie together.
class DifferenceRows {
 public:
  DifferenceRows(const StripeImages& images, const StripeStack& stack, const cv::Mat& contrast)
      : images_(images),
        stack_(stack),
        contrast_(contrast),
        row_(static_cast<std::size_t>(contrast.cols)),
        other_(row_) {}

  void read(int y, std::vector<float>& differences) {
    const std::size_t bits = stack_.patterns.size();
    differences.resize(row_.size() * bits);
    for (std::size_t b = 0; b < bits; ++b) {
      read_row(stack_.patterns[b], y, row_);
      if (stack_.inverses.empty()) {
        read_row(images_.white, y, other_);
        const auto* contrast = contrast_.ptr<float>(y);
        for (std::size_t x = 0; x < row_.size(); ++x) other_[x] = 2 * other_[x] - contrast[x] - row_[x];
      } else {
        read_row(stack_.inverses[b], y, other_);
      }
      for (std::size_t x = 0; x < row_.size(); ++x) differences[x * bits + b] = row_[x] - other_[x];
    }
  }

 private:
  const StripeImages& images_;
  const StripeStack& stack_;
  const cv::Mat& contrast_;
  std::vector<float> row_, other_;
};

BitVector bits_of(const std::vector<float>& differences, int x, std::size_t bits) {
  BitVector v = BitVector::Zero();
  const float* pixel = differences.data() + static_cast<std::size_t>(x) * bits;
  for (std::size_t b = 0; b < bits; ++b) v[static_cast<Eigen::Index>(b)] = pixel[b];
  return v;
}

std::vector<PixelSignal> sample_pixels(const DecodedStripes& decoded, DifferenceRows rows, std::size_t bits) {
  const auto count = static_cast<std::size_t>(cv::countNonZero(decoded.stripe >= 0));
  const std::size_t every = std::max<std::size_t>(1, count / kBlurSample);
  std::vector<PixelSignal> sample;
  std::vector<float> differences;
  std::size_t n = 0;
  for (int y = 0; y < decoded.stripe.rows; ++y) {
    const auto* stripe = decoded.stripe.ptr<int>(y);
    bool read = false;
    for (int x = 0; x < decoded.stripe.cols; ++x) {
      if (stripe[x] < 0 || n++ % every != 0) continue;
      if (!read) rows.read(y, differences);
      read = true;
      PixelSignal pixel{.x = x, .y = y, .start = stripe[x] + 0.5};
      pixel.differences = bits_of(differences, x, bits);
      sample.push_back(pixel);
    }
  }
  return sample;
}

// The contrast once more, with less noise: the sum of a pattern and its inverse is the same in every bit.
cv::Mat brightness_image(const StripeImages& images, const StripeStack& stack, const cv::Mat& contrast) {
  if (stack.inverses.empty() || images.black.empty()) return contrast;
  cv::Mat sum = cv::Mat::zeros(contrast.size(), CV_32F);
  for (std::size_t b = 0; b < stack.patterns.size(); ++b) {
    cv::add(sum, stack.patterns[b], sum, cv::noArray(), CV_32F);
    cv::add(sum, stack.inverses[b], sum, cv::noArray(), CV_32F);
  }
  cv::Mat brightness;
  cv::addWeighted(sum, 1 / static_cast<double>(stack.patterns.size()), images.black, -2, 0, brightness, CV_32F);
  return cv::max(brightness, 0);
}

struct FitImages {
  cv::Mat u;            // CV_64F stripe widths
  cv::Mat gain;         // CV_32F grey levels; 0 where nothing was fitted
  cv::Mat information;  // CV_32F
  cv::Mat squares;      // CV_32F mean square residual per degree of freedom
};

FitImages fit_pixels(const DecodedStripes& decoded, const DifferenceRows& rows, std::size_t bits,
                     const StripeModel& model) {
  const cv::Size size = decoded.stripe.size();
  FitImages fits{cv::Mat(size, CV_64F, cv::Scalar(0)), cv::Mat(size, CV_32F, cv::Scalar(0)),
                 cv::Mat(size, CV_32F, cv::Scalar(0)), cv::Mat(size, CV_32F, cv::Scalar(0))};
  const auto freedom = std::max(1.0, static_cast<double>(bits) - 2);
  cv::parallel_for_({0, size.height}, [&](const cv::Range& range) {
    DifferenceRows reader = rows;
    std::vector<float> differences;
    for (int y = range.start; y < range.end; ++y) {
      const auto* stripe = decoded.stripe.ptr<int>(y);
      if (std::all_of(stripe, stripe + size.width, [](int k) { return k < 0; })) continue;
      reader.read(y, differences);
      for (int x = 0; x < size.width; ++x) {
        if (stripe[x] < 0) continue;
        const StripeFit fit =
            fit_stripe(model.table_at(x, y), model.offsets, bits_of(differences, x, bits), stripe[x] + 0.5, kReach);
        if (!(fit.information > 0) || std::abs(fit.u - stripe[x] - 0.5) > kReach + 0.5) continue;
        fits.u.at<double>(y, x) = fit.u;
        fits.gain.at<float>(y, x) = static_cast<float>(fit.gain);
        fits.information.at<float>(y, x) = static_cast<float>(fit.information);
        fits.squares.at<float>(y, x) = static_cast<float>(fit.squares / freedom);
      }
    }
  });
  return fits;
}

// Variance of a difference against the gain: medians over classes of gain, linear in between. The median of a mean
// square with f degrees of freedom lies below its mean by (1 - 2/(9f))^3 (Wilson and Hilferty 1931).
class NoiseModel {
 public:
  NoiseModel(const FitImages& fits, double freedom) {
    std::vector<std::pair<float, float>> pixels;
    for (int y = 0; y < fits.gain.rows; ++y) {
      for (int x = 0; x < fits.gain.cols; ++x) {
        const float gain = fits.gain.at<float>(y, x);
        if (gain > 0) pixels.emplace_back(gain, fits.squares.at<float>(y, x));
      }
    }
    std::sort(pixels.begin(), pixels.end());
    const std::size_t classes = std::min(kGainClasses, (pixels.size() + 99) / 100);
    for (std::size_t c = 0; c < classes; ++c) {
      const auto first = pixels.begin() + static_cast<std::ptrdiff_t>(c * pixels.size() / classes);
      const auto last = pixels.begin() + static_cast<std::ptrdiff_t>((c + 1) * pixels.size() / classes);
      const auto middle = first + (last - first) / 2;
      const double gain = middle->first;
      std::nth_element(first, middle, last, [](const auto& a, const auto& b) { return a.second < b.second; });
      const double median_over_mean = std::pow(1 - 2 / (9 * freedom), 3);
      classes_.push_back({gain, std::max(double{middle->second} / median_over_mean, kQuantisation)});
    }
  }

  double variance(double gain) const {
    if (classes_.empty()) return kQuantisation;
    std::size_t i = 0;
    while (i + 1 < classes_.size() && classes_[i + 1].gain < gain) ++i;
    if (i + 1 == classes_.size() || gain <= classes_[i].gain) return classes_[i].variance;
    const double t = (gain - classes_[i].gain) / (classes_[i + 1].gain - classes_[i].gain);
    return (1 - t) * classes_[i].variance + t * classes_[i + 1].variance;
  }

 private:
  // The difference of two rounded grey levels is never better than this.
  static constexpr double kQuantisation = 2.0 / 12;
  struct Class {
    double gain;
    double variance;
  };
  std::vector<Class> classes_;
};

cv::Mat gated_sigma(const FitImages& fits, const NoiseModel& noise, const PhaseOptions& options) {
  cv::Mat sigma(fits.u.size(), CV_32F, cv::Scalar(0));
  for (int y = 0; y < sigma.rows; ++y) {
    for (int x = 0; x < sigma.cols; ++x) {
      const float gain = fits.gain.at<float>(y, x);
      if (gain <= 0) continue;
      const double variance = noise.variance(gain);
      const double s = std::sqrt(variance / fits.information.at<float>(y, x));
      const bool kept = s <= options.max_sigma && fits.squares.at<float>(y, x) <= options.gate * variance;
      if (kept) sigma.at<float>(y, x) = static_cast<float>(s);
    }
  }
  return sigma;
}

}  // namespace

StripeCoordinates estimate_stripe_phase(const StripeImages& images, std::size_t stack_index,
                                        const DecodedStripes& decoded, const PhaseOptions& options) {
  const StripeStack& stack = images.stacks[stack_index];
  const std::size_t bits = stack.patterns.size();
  const cv::Mat contrast = contrast_image(images);
  const DifferenceRows rows(images, stack, contrast);

  StripeCoordinates result;
  result.model =
      fit_stripe_model(stack.orientation, images.projector, contrast.size(), sample_pixels(decoded, rows, bits));
  FitImages fits = fit_pixels(decoded, rows, bits, result.model);
  const NoiseModel noise(fits, std::max(1.0, static_cast<double>(bits) - 2));
  cv::Mat sigma = gated_sigma(fits, noise, options);
  if (options.correct) result.correction = correct_phase(fits.u, sigma, brightness_image(images, stack, contrast));

  const double width = stack.orientation.stripe_width_px;
  const double origin = stripe_origin_px(stack.orientation, images.projector);
  result.coordinate_px = fits.u * width + origin;
  result.coordinate_px.setTo(0, sigma <= 0);
  result.sigma_px = sigma * width;
  result.gain = fits.gain;
  return result;
}

}  // namespace crumple
