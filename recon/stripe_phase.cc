#include "recon/stripe_phase.h"

#include <algorithm>
#include <cmath>

#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "recon/difference_rows.h"
#include "recon/noise_model.h"
#include "recon/phase_neighbourhoods.h"

namespace crumple {
namespace {

// A hundred or so per tile of the blur's map; more only costs time.
constexpr std::size_t kBlurSample = 8000;
constexpr double kReach = 2;  // stripes around the decoded one
// Stripe widths; what is farther from its neighbours' plane is no noise.
constexpr double kOneSurface = 0.3;
constexpr double kOneGain = 0.1;  // likewise, of a gain

std::vector<PixelSignal> sample_pixels(const DecodedStripes& decoded, DifferenceRows rows) {
  const auto count = static_cast<std::size_t>(cv::countNonZero(decoded.stripe >= 0));
  const std::size_t every = std::max<std::size_t>(1, count / kBlurSample);
  std::vector<PixelSignal> sample;
  std::size_t n = 0;
  for (int y = 0; y < decoded.stripe.rows; ++y) {
    const auto* stripe = decoded.stripe.ptr<int>(y);
    bool read = false;
    for (int x = 0; x < decoded.stripe.cols; ++x) {
      if (stripe[x] < 0 || n++ % every != 0) continue;
      if (!read) rows.read(y);
      read = true;
      sample.push_back({.x = x, .y = y, .start = stripe[x] + 0.5, .differences = rows.bits(x)});
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
    for (int y = range.start; y < range.end; ++y) {
      const auto* stripe = decoded.stripe.ptr<int>(y);
      if (std::all_of(stripe, stripe + size.width, [](int k) { return k < 0; })) continue;
      reader.read(y);
      for (int x = 0; x < size.width; ++x) {
        if (stripe[x] < 0) continue;
        const StripeFit fit = fit_stripe(model.table_at(x, y), model.offsets, reader.bits(x), stripe[x] + 0.5, kReach);
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

NoiseModel residual_noise(const FitImages& fits, double freedom) {
  std::vector<NoiseModel::Sample> samples;
  for (int y = 0; y < fits.gain.rows; ++y) {
    for (int x = 0; x < fits.gain.cols; ++x) {
      const float gain = fits.gain.at<float>(y, x);
      if (gain > 0) samples.push_back({gain, fits.squares.at<float>(y, x)});
    }
  }
  return NoiseModel(std::move(samples), freedom);
}

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

// The mean gain of the neighbours that have one, but a pixel's own where it is truly another.
cv::Mat gain_by_neighbours(const cv::Mat& gain, const cv::Mat& valid) {
  const cv::Size reach(5, 5);
  cv::Mat kept, share, mean;
  gain.copyTo(kept, valid);
  cv::blur(kept, mean, reach, {-1, -1}, cv::BORDER_CONSTANT);
  cv::blur(valid, share, reach, {-1, -1}, cv::BORDER_CONSTANT);
  cv::divide(mean, share, mean, 255, CV_32F);
  gain.copyTo(mean, cv::abs(mean - gain) > kOneGain * gain);
  return mean;
}

// Sigma with each coordinate's phase and gain as its neighbours tell them, where they lie on one surface with it.
cv::Mat sigma_by_neighbours(const FitImages& fits, const NoiseModel& noise, const StripeModel& model,
                            const cv::Mat& own_sigma, const PhaseNeighbourhoods& mean, double max_sigma) {
  cv::Mat sigma = own_sigma.clone();
  const cv::Mat gains = gain_by_neighbours(fits.gain, own_sigma > 0);
  cv::parallel_for_({0, sigma.rows}, [&](const cv::Range& rows) {
    for (int y = rows.start; y < rows.end; ++y) {
      for (int x = 0; x < sigma.cols; ++x) {
        auto& s = sigma.at<float>(y, x);
        const double u = mean.u.at<double>(y, x);
        if (mean.sigma.at<float>(y, x) <= 0 || std::abs(u - fits.u.at<double>(y, x)) > kOneSurface) continue;
        const double gain = gains.at<float>(y, x);
        const double information = stripe_information(model.table_at(x, y), model.offsets, u, gain);
        const double by_neighbours = std::sqrt(noise.variance(gain) / information);
        s = by_neighbours <= max_sigma ? static_cast<float>(by_neighbours) : 0.0F;
      }
    }
  });
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
  result.model = fit_stripe_model(stack.orientation, images.projector, contrast.size(), sample_pixels(decoded, rows));
  FitImages fits = fit_pixels(decoded, rows, bits, result.model);
  const NoiseModel noise = residual_noise(fits, std::max(1.0, static_cast<double>(bits) - 2));
  const cv::Mat own_sigma = gated_sigma(fits, noise, options);
  PhaseNeighbourhoods mean = phase_neighbourhoods(fits.u, own_sigma);
  cv::Mat sigma = sigma_by_neighbours(fits, noise, result.model, own_sigma, mean, options.max_sigma);
  mean.sigma.setTo(0, sigma <= 0);
  if (options.correct) {
    result.correction = correct_phase(fits.u, sigma, brightness_image(images, stack, contrast), mean);
  }

  const double width = stack.orientation.stripe_width_px;
  const double origin = stripe_origin_px(stack.orientation, images.projector);
  result.coordinate_px = fits.u * width + origin;
  result.coordinate_px.setTo(0, sigma <= 0);
  result.sigma_px = sigma * width;
  result.gain = fits.gain;
  return result;
}

}  // namespace crumple
