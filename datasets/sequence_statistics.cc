#include "datasets/sequence_statistics.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdlib>

#include <opencv2/core.hpp>

namespace crumple {
namespace {

constexpr int kPixelBudget = 1'500'000;
constexpr int kBandRows = 64;
constexpr int kCorrelationSamples = 60'000;
constexpr int kEdgesUsed = 4000;  // per frame
constexpr int kMiddleGrey = 127;  // of the scaled values
constexpr int kClear = 38;        // a value this far from the middle is clearly lit or dark
constexpr int kBeside = 1;        // px from the edge's two pixels to where both sides must be clear

struct Rows {
  int first;
  int count;
};

std::vector<Rows> bands(cv::Size size) {
  if (size.area() <= kPixelBudget) return {{0, size.height}};
  const int count = std::max(1, kPixelBudget / (size.width * kBandRows));
  std::vector<Rows> result;
  for (int i = 0; i < count; ++i) {
    result.push_back(
        {static_cast<int>(static_cast<std::int64_t>(std::max(0, size.height - kBandRows)) * i / std::max(1, count - 1)),
         std::min(kBandRows, size.height)});
  }
  return result;
}

cv::Mat sampled(const cv::Mat& image, const std::vector<Rows>& rows) {
  if (rows.size() == 1) return image;
  cv::Mat result;
  for (const Rows& band : rows) result.push_back(image.rowRange(band.first, band.first + band.count));
  return result;
}

// The n-th smallest and n-th largest value of each pixel, n = outliers + 1, by insertion into sorted layers.
struct Range {
  cv::Mat low;
  cv::Mat high;
};

Range intensity_range(const std::vector<cv::Mat>& images, int outliers) {
  std::vector<cv::Mat> lowest;
  std::vector<cv::Mat> highest;
  for (const cv::Mat& image : images) {
    if (image.empty()) continue;
    cv::Mat up = image.clone();
    cv::Mat down = image.clone();
    cv::Mat displaced;
    for (std::size_t layer = 0; layer < lowest.size(); ++layer) {
      cv::max(lowest[layer], up, displaced);
      cv::min(lowest[layer], up, lowest[layer]);
      cv::swap(up, displaced);
      cv::min(highest[layer], down, displaced);
      cv::max(highest[layer], down, highest[layer]);
      cv::swap(down, displaced);
    }
    if (lowest.size() <= static_cast<std::size_t>(outliers)) {
      lowest.push_back(up.clone());
      highest.push_back(down.clone());
    }
  }
  return {lowest.back(), highest.back()};
}

cv::Mat1b scaled_to_range(const cv::Mat& image, const cv::Mat1f& low, const cv::Mat1f& gain) {
  cv::Mat1f value;
  image.convertTo(value, CV_32F);
  value = (value - low).mul(gain);
  cv::Mat1b scaled;
  value.convertTo(scaled, CV_8U);
  cv::min(scaled, 2 * kMiddleGrey, scaled);
  return scaled;
}

struct Edge {
  int at;      // offset of the first of the two pixels the edge runs between
  int beside;  // offset from it to the second
};

// Where the frame crosses its middle between two neighbours and is clear on both sides.
std::vector<Edge> find_edges(const cv::Mat1b& frame, const cv::Mat1b& lit) {
  std::vector<Edge> edges;
  const auto side = [](int value) {
    return value > kMiddleGrey + kClear ? 1 : (value < kMiddleGrey - kClear ? -1 : 0);
  };
  for (const int step : {1, frame.cols}) {
    const bool across_rows = step != 1;
    for (int y = across_rows ? kBeside : 0; y < frame.rows - (across_rows ? 1 + kBeside : 0); ++y) {
      for (int x = across_rows ? 0 : kBeside; x < frame.cols - (across_rows ? 0 : 1 + kBeside); ++x) {
        const int at = y * frame.cols + x;
        const std::uint8_t* value = frame.data + at;
        if ((value[0] > kMiddleGrey) == (value[step] > kMiddleGrey)) continue;
        if (side(value[-kBeside * step]) * side(value[(1 + kBeside) * step]) != -1) continue;
        const std::uint8_t* mask = lit.data + at;
        if (mask[-kBeside * step] && mask[0] && mask[step] && mask[(1 + kBeside) * step]) edges.push_back({at, step});
      }
    }
  }
  return edges;
}

void measure_along_edges(std::size_t c, SequenceStatistics& statistics) {
  const std::vector<Edge> edges = find_edges(statistics.scaled[c], statistics.lit);
  statistics.edge_count[c] = static_cast<int>(edges.size());
  if (edges.empty()) return;
  const std::size_t stride = edges.size() / kEdgesUsed + 1;
  for (std::size_t b = 0; b < statistics.scaled.size(); ++b) {
    if (statistics.scaled[b].empty()) continue;
    std::int64_t sum = 0;
    std::int64_t count = 0;
    for (std::size_t i = 0; i < edges.size(); i += stride, ++count) {
      const std::uint8_t* value = statistics.scaled[b].data + edges[i].at;
      sum += value[0] + value[edges[i].beside] - 2 * kMiddleGrey;
    }
    statistics.along_edges(static_cast<int>(c), static_cast<int>(b)) =
        static_cast<double>(sum) / (2.0 * kMiddleGrey * static_cast<double>(count));
  }
}

// Values of the lit pixels on a regular grid, about zero.
std::vector<std::vector<std::int16_t>> lit_samples(const SequenceStatistics& statistics) {
  std::vector<int> offsets;
  const int lit = cv::countNonZero(statistics.lit);
  const int stride = lit / kCorrelationSamples + 1;
  int seen = 0;
  for (int i = 0; i < statistics.lit.rows * statistics.lit.cols; ++i) {
    if (statistics.lit.data[i] && seen++ % stride == 0) offsets.push_back(i);
  }
  std::vector<std::vector<std::int16_t>> samples(statistics.scaled.size());
  for (std::size_t f = 0; f < samples.size(); ++f) {
    if (statistics.scaled[f].empty()) continue;
    for (const int offset : offsets) {
      samples[f].push_back(static_cast<std::int16_t>(statistics.scaled[f].data[offset] - kMiddleGrey));
    }
  }
  return samples;
}

std::int64_t dot(const std::vector<std::int16_t>& a, const std::vector<std::int16_t>& b) {
  std::int64_t sum = 0;
  for (std::size_t i = 0; i < std::min(a.size(), b.size()); ++i) sum += std::int32_t{a[i]} * b[i];
  return sum;
}

void measure_values(SequenceStatistics& statistics) {
  const auto samples = lit_samples(statistics);
  for (std::size_t a = 0; a < samples.size(); ++a) {
    if (samples[a].empty()) continue;
    std::int64_t total = 0;
    std::int64_t dark = 0;
    for (const std::int16_t value : samples[a]) {
      total += std::abs(value);
      dark += value < 0 ? 1 : 0;
    }
    const auto count = static_cast<double>(samples[a].size());
    statistics.amplitude[a] = static_cast<double>(total) / (kMiddleGrey * count);
    statistics.dark_share[a] = static_cast<double>(dark) / count;
    for (std::size_t b = 0; b <= a; ++b) {
      if (samples[b].empty()) continue;
      const double scale = std::sqrt(static_cast<double>(dot(samples[a], samples[a])) *
                                     static_cast<double>(dot(samples[b], samples[b])));
      const double rho = scale > 0 ? static_cast<double>(dot(samples[a], samples[b])) / scale : 0;
      statistics.correlation(static_cast<int>(a), static_cast<int>(b)) = rho;
      statistics.correlation(static_cast<int>(b), static_cast<int>(a)) = rho;
    }
  }
}

}  // namespace

SequenceStatistics sequence_statistics(const std::vector<cv::Mat>& images, int outliers, double lit_threshold) {
  SequenceStatistics statistics;
  const std::size_t count = images.size();
  statistics.edge_count.assign(count, 0);
  statistics.amplitude.assign(count, 0);
  statistics.dark_share.assign(count, 0);
  statistics.along_edges = cv::Mat1d::zeros(static_cast<int>(count), static_cast<int>(count));
  statistics.correlation = cv::Mat1d::zeros(static_cast<int>(count), static_cast<int>(count));
  statistics.scaled.resize(count);
  const auto first = std::find_if(images.begin(), images.end(), [](const cv::Mat& image) { return !image.empty(); });
  if (first == images.end()) return statistics;

  const std::vector<Rows> rows = bands(first->size());
  statistics.band_rows = rows.front().count;
  std::vector<cv::Mat> parts;
  for (const cv::Mat& image : images) parts.push_back(image.empty() ? cv::Mat() : sampled(image, rows));
  const Range range = intensity_range(parts, outliers);
  cv::Mat1f low;
  cv::Mat1f high;
  range.low.convertTo(low, CV_32F);
  range.high.convertTo(high, CV_32F);
  const cv::Mat1f contrast(high - low);
  statistics.lit = contrast > lit_threshold;
  statistics.lit_share = static_cast<double>(cv::countNonZero(statistics.lit)) / static_cast<double>(contrast.total());
  // Nothing may seem to run on from one band to the next.
  for (std::size_t i = 1; i < rows.size(); ++i) statistics.lit.row(static_cast<int>(i) * kBandRows - 1).setTo(0);

  const cv::Mat1f gain(2.0 * kMiddleGrey / cv::max(contrast, 1.0));
  for (std::size_t f = 0; f < count; ++f) {
    if (!parts[f].empty()) statistics.scaled[f] = scaled_to_range(parts[f], low, gain);
  }
  for (std::size_t f = 0; f < count; ++f) {
    if (!statistics.scaled[f].empty()) measure_along_edges(f, statistics);
  }
  measure_values(statistics);
  return statistics;
}

}  // namespace crumple
