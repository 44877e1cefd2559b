#include "recon/stripe_response.h"

#include <algorithm>
#include <cmath>

#include <opencv2/core.hpp>

namespace crumple {
namespace {

double gaussian_transfer(double sigma, double frequency) {
  const double phase = M_PI * frequency * sigma;
  return std::exp(-2 * phase * phase);
}

double d_gaussian_transfer_d_log_sigma(double sigma, double frequency) {
  const double phase = M_PI * frequency * sigma;
  return -4 * phase * phase * std::exp(-2 * phase * phase);
}

}  // namespace

double blur_transfer(const StripeBlur& blur, double frequency) {
  return (1 - blur.skirt_share - blur.halo_share) * gaussian_transfer(blur.core, frequency) +
         blur.skirt_share * gaussian_transfer(blur.skirt, frequency) +
         blur.halo_share * gaussian_transfer(StripeBlur::kHalo, frequency);
}

std::array<double, 4> d_blur_transfer(const StripeBlur& blur, double frequency) {
  const double core = gaussian_transfer(blur.core, frequency);
  return {(1 - blur.skirt_share - blur.halo_share) * d_gaussian_transfer_d_log_sigma(blur.core, frequency),
          blur.skirt_share * d_gaussian_transfer_d_log_sigma(blur.skirt, frequency),
          gaussian_transfer(blur.skirt, frequency) - core, gaussian_transfer(StripeBlur::kHalo, frequency) - core};
}

std::size_t StripeTable::sample_below(double position) const {
  const auto last = static_cast<int>(values_.size()) - 3;
  return static_cast<std::size_t>(std::clamp(static_cast<int>(std::floor(position)), 1, last));
}

StripeTable::Sample StripeTable::at(double u) const {
  const double position = (u + kMargin) * kSamplesPerStripe - 0.5;
  const std::size_t j = sample_below(position);
  const auto f = static_cast<float>(position - static_cast<double>(j));
  constexpr float kHalfRate = 0.5F * kSamplesPerStripe;
  return {values_[j] + f * (values_[j + 1] - values_[j]),
          kHalfRate * ((1 - f) * (values_[j + 1] - values_[j - 1]) + f * (values_[j + 2] - values_[j]))};
}

const BitVector& StripeTable::nearest(double u) const {
  return values_[sample_below((u + kMargin) * kSamplesPerStripe)];
}

StripeSpectrum::StripeSpectrum(const StripeOrientation& orientation, ImageSize projector)
    : bits_(orientation.bits),
      samples_((stripe_count(orientation, projector) + 2 * StripeTable::kMargin) * StripeTable::kSamplesPerStripe) {
  // Room behind the stripes keeps the halo from coming round to the other side.
  const int room = static_cast<int>(3 * StripeBlur::kHalo) * StripeTable::kSamplesPerStripe;
  int size = cv::getOptimalDFTSize(samples_ + room);
  while (size % 2 != 0) size = cv::getOptimalDFTSize(size + 1);
  cv::Mat stripes = cv::Mat::zeros(bits_, size, CV_64F);
  const int count = stripe_count(orientation, projector);
  for (int b = 0; b < bits_; ++b) {
    auto* row = stripes.ptr<double>(b);
    for (int k = 0; k < count; ++k) {
      const unsigned gray = gray_from_binary(static_cast<unsigned>(k + orientation.code_offset));
      const double sign = (gray >> (bits_ - 1 - b) & 1U) != 0 ? 1 : -1;
      std::fill_n(row + (k + StripeTable::kMargin) * StripeTable::kSamplesPerStripe, StripeTable::kSamplesPerStripe,
                  sign);
    }
  }
  cv::dft(stripes, spectrum_, cv::DFT_ROWS);
}

StripeTable StripeSpectrum::blurred(const std::function<double(double frequency)>& transfer) const {
  const int size = spectrum_.cols;
  // OpenCV packs the transform of real data as Re0, Re1, Im1, Re2, Im2, ..., Re(size / 2).
  std::vector<double> factor(static_cast<std::size_t>(size));
  for (int i = 0; i < size; ++i) {
    const int cycles = (i + 1) / 2;
    factor[static_cast<std::size_t>(i)] = transfer(cycles * double{StripeTable::kSamplesPerStripe} / size);
  }
  cv::Mat filtered = spectrum_.clone();
  for (int b = 0; b < bits_; ++b) {
    auto* row = filtered.ptr<double>(b);
    for (std::size_t i = 0; i < factor.size(); ++i) row[i] *= factor[i];
  }
  cv::dft(filtered, filtered, cv::DFT_ROWS | cv::DFT_INVERSE | cv::DFT_SCALE | cv::DFT_REAL_OUTPUT);
  StripeTable table;
  table.values_.assign(static_cast<std::size_t>(samples_), BitVector::Zero());
  for (int b = 0; b < bits_; ++b) {
    const auto* row = filtered.ptr<double>(b);
    for (std::size_t j = 0; j < table.values_.size(); ++j) table.values_[j][b] = static_cast<float>(row[j]);
  }
  return table;
}

}  // namespace crumple
